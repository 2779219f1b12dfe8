"""Command line of the agents: what there is to compare with, and how good it is.

python -m agents evaluate --policy NAME [NAME ...] --population NAME --patients N --seed S --out DIR
python -m agents policies
python -m agents tune-baselines [--tries N] [--patients N] [--workers N] [--out DIR]
python -m agents train --config FILE [--seed S] [--set KEY=VALUE ...] [--out DIR] | --resume DIR
python -m agents export RUN --out DIR
python -m agents report RUN [RUN ...] --out DIR
python -m agents sweep --configs FILE [FILE ...] | --variations FILE --seeds S [S ...] --out DIR
python -m agents ablations --variations FILE --runs DIR --seeds S [S ...] --out DIR
python -m agents shift --policy NAME [NAME ...] --out DIR [--shifts NAME ...] [--patients N] [--workers N]
python -m agents adaptation --policy NAME [NAME ...] --out DIR [--patients N] [--tries N] [--workers N]
python -m agents upper-bound --out FILE.csv
python -m agents hindsight --out FILE.csv [--patients N] [--tries N] [--workers N]
python -m agents picture --policy A B --patient NAME --seed S --out FILE.png
python -m agents video --policy A B --patient NAME --out FILE.mp4

A command renews a folder that it wrote; a file that exists, or a folder of others, it replaces with --overwrite only.
Where the wheel is installed, the same commands stand under `python -m exo_agents`.
"""

from __future__ import annotations

import sys

from dms_core.command_line import run_command

from .commands.evaluate import evaluate, policies
from .commands.pictures.picture import picture
from .commands.pictures.report import report
from .commands.pictures.video import video
from .commands.search.hindsight import hindsight
from .commands.search.tune_baselines import tune_baselines
from .commands.search.upper_bound import upper_bound
from .commands.studies.ablations import ablations
from .commands.studies.adaptation import adaptation
from .commands.studies.shift import shift
from .commands.training.export import export
from .commands.training.sweep import sweep
from .commands.training.train import train
from .environment import PROGRAM


def main(arguments: list[str] | None = None) -> int:
    """Run a command; a mistake of the user is one message on stderr and status 2."""
    return run_command(
        {
            "evaluate": evaluate,
            "policies": policies,
            "train": train,
            "export": export,
            "report": report,
            "sweep": sweep,
            "ablations": ablations,
            "shift": shift,
            "adaptation": adaptation,
            "tune-baselines": tune_baselines,
            "upper-bound": upper_bound,
            "hindsight": hindsight,
            "picture": picture,
            "video": video,
        },
        PROGRAM,
        "Policies for the environments of exo_env, their training and their evaluation.",
        arguments,
    )


if __name__ == "__main__":
    sys.exit(main())

"""Command line of the ecosystem: the paper's scenarios and tuning, one's own, and the bare arm.

python -m exo_env scenarios --out DIR [--exoskeleton NAME|FILE.yaml] [--subject NAME|FILE.yaml] [--exercise FILE.yaml]
                        [--scenarios FILE.yaml ...]
python -m exo_env tune --out DIR [--exoskeleton NAME|FILE.yaml]
python -m exo_env design --out DIR [--objective peak_tension|elbow_reaction|motor_power] [--bounds FILE.yaml]
python -m exo_env arm26 --excitations FILE.csv --start-deg D --start-activation A --t-end T --rtol R --sample DT
                        --out FILE.csv
python -m exo_env soak --steps N [--env ID] [--exoskeleton NAME|FILE.yaml]

A command renews a folder that it wrote; a file that exists, or a folder of others, it replaces with --overwrite only.
"""

from __future__ import annotations

import sys

from dms_core.command_line import run_command
from exo_env.commands.arm26 import arm26
from exo_env.commands.design import design
from exo_env.commands.scenarios import scenarios
from exo_env.commands.soak import soak
from exo_env.commands.tune import tune


def main(arguments: list[str] | None = None) -> int:
    """Run a command; a mistake of the user is one message on stderr and status 2."""
    return run_command(
        {"scenarios": scenarios, "tune": tune, "design": design, "arm26": arm26, "soak": soak},
        "python -m exo_env",
        "A subject with an elbow exoskeleton on a gym machine: scenarios, tuning, design, the bare arm, and long runs.",
        arguments,
    )


if __name__ == "__main__":
    sys.exit(main())

"""Command line of the agents: what there is to compare with, and how good it is.

python -m agents evaluate --policy NAME [NAME ...] --population NAME --patients N --seed S --out DIR
python -m agents policies
python -m agents tune-baselines [--tries N] [--patients N] [--workers N] [--out DIR]
python -m agents train --config FILE [--seed S] [--set KEY=VALUE ...] [--out DIR] | --resume DIR
python -m agents export RUN --out DIR
python -m agents report RUN [RUN ...] --out DIR
python -m agents sweep --configs FILE [FILE ...] --seeds S [S ...] --out DIR
python -m agents video --policy A B --patient NAME --out FILE.mp4
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

from tqdm import tqdm
from tyro.conf import arg

from agents.commands.report import report
from agents.commands.train import train
from agents.commands.tune_baselines import tune_baselines
from agents.commands.video import video
from agents.distributed.sweep import sweep
from agents.evaluation.evaluate import evaluate as run_all
from agents.evaluation.figure import draw
from agents.evaluation.tables import heading, short_table, statistic, whole_table
from agents.export.export import export
from agents.policies.baselines import POLICIES
from agents.policies.learned import find_policy, repetitions_of, shipped_policies
from dms_core.command_line import run_command
from dms_core.errors import InputError
from dms_core.output_file import check_writable, whole_file, write_json
from exo_env.patient.population import population as find_population
from exo_env.rendering.panels import require_matplotlib


def evaluate(
    policy_names: Annotated[tuple[str, ...], arg(name="policy", metavar="NAME [NAME ...]")],
    out: Path,
    population: str = "evaluation",
    patients: int = 20,
    seed: int = 0,
    loads: tuple[float, ...] = (),
    repetitions: int | None = None,
    workers: Literal["here", "ray"] = "here",
    address: str | None = None,
) -> int:
    """Run policies on the same patients: a table, evaluation.json, evaluation.md and evaluation.png.

    Args:
        policy_names: one or more, see `python -m agents policies`, or folders of trained ones.
        out: folder for the results; made where it is missing.
        population: of the patients, by name or YAML file.
        patients: how many; one episode each, or one a load.
        seed: of the patients and of the bootstrap.
        loads: that each patient lifts [kg]; one drawn for each patient where none is given.
        repetitions: of the movement in an episode; as the trained policies learned, 1 without one, where not given.
        workers: 'ray' shares the episodes out, with the same results to the last bit.
        address: of a Ray cluster; a local one is started where it is not given.
    """
    if len(set(policy_names)) < max(len(policy_names), 1):
        raise InputError(f"--policy {' '.join(policy_names)}: one or more different names are wanted.")
    used = [find_policy(name) for name in policy_names]
    often = repetitions_of(used, repetitions)
    find_population(population)
    require_matplotlib()
    check_writable(out / "evaluation.json")
    with tqdm(
        total=len(used) * max(patients, 0) * max(len(loads), 1), unit="episode", leave=False, disable=None
    ) as bar:

        def progress(name: str) -> None:
            bar.set_description(name)
            bar.update()

        if workers == "ray":
            from agents.distributed.shared_evaluation import evaluate_by_ray

            results = evaluate_by_ray(
                used, population, patients, seed, loads=loads, address=address, progress=progress,
                repetitions=often,
            )  # fmt: skip
        else:
            results = run_all(used, population, patients, seed, loads=loads, progress=progress, repetitions=often)
    write_json(out / "evaluation.json", _json(results))
    draw(out / "evaluation.png", results)
    with whole_file(out / "evaluation.md") as file:
        file.write("\n".join(whole_table(results)))
    print(f"{heading(results)}\n{statistic(results)}\n\n{short_table(results)}\n")
    print(f"written: {out} (all measures: evaluation.md, all episodes: evaluation.json)")
    return 0


def policies() -> int:
    """List the policies that `evaluate` knows."""
    for name, kind in POLICIES.items():
        print(f"{name:18} {kind.title}; action mode {kind.action_mode}, sees {', '.join(kind.observation)}")
    for name in shipped_policies():
        one = find_policy(name)
        print(f"{name:18} {one.title}; action mode {one.action_mode}, sees {', '.join(one.observation)}")
    return 0


def _json(value: Any) -> Any:
    """JSON has no NaN: what could not be measured is null."""
    if isinstance(value, dict):
        return {k: _json(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_json(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


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
            "tune-baselines": tune_baselines,
            "video": video,
        },
        "python -m agents",
        "Policies for exo/ElbowLift-v0 and their evaluation.",
        arguments,
    )


if __name__ == "__main__":
    sys.exit(main())

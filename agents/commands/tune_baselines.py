"""python -m agents tune-baselines: numbers of the baselines for the training population."""

from __future__ import annotations

import csv
import io
import shlex
import sys
from pathlib import Path
from typing import Annotated

from tqdm import tqdm
from tyro.conf import arg

from dms_core.config_files import configs
from dms_core.output_file import check_writable, whole_file

from ..environment import ENVIRONMENT, PROGRAM
from ..evaluation.tuning import MEASURED, POPULATION, Try, tunable, tune
from ..policies.tuned import FILE
from .options import device_settings

TRIES = "baselines_tries.csv"


def tune_baselines(
    tries: int = 48,
    population: str = POPULATION,
    patients: int = 30,
    seed: int = 0,
    repetitions: int = 1,
    workers: int = 1,
    out: Path | None = None,
    environment: Annotated[str, arg(name="env", metavar="ID")] = ENVIRONMENT,
    exoskeleton: str | None = None,
) -> int:
    """Search the baselines' numbers for the best mean return on the training population.

    Args:
        tries: of each policy, half of them spread over its ranges and half around the best.
        population: to train on, by name or YAML file.
        patients: episodes of each try.
        seed: of the patients and of the search.
        repetitions: of the movement in an episode.
        workers: processes.
        out: folder of baselines.yml, which the policies read, and of the table of tries; default: where they read it.
        environment: in which, by id.
        exoskeleton: device by name or YAML file, or changes of the default one as JSON.
    """
    folder = (configs() / FILE).parent if out is None else out
    check_writable(folder / TRIES)
    settings = device_settings(exoskeleton)
    command = f"{PROGRAM} tune-baselines --tries {tries} --patients {patients} --seed {seed}"
    command += f" --population {shlex.quote(population)}" if population != POPULATION else ""
    command += f" --repetitions {repetitions}" if repetitions > 1 else ""
    command += f" --env {environment}" if environment != ENVIRONMENT else ""
    command += f" --exoskeleton {shlex.quote(exoskeleton)}" if exoskeleton else ""
    best_first: dict[str, list[Try]] = {}
    with tqdm(total=len(tunable()) * tries, unit="try", leave=False, disable=None, file=sys.stderr) as bar:

        def progress(name: str) -> None:
            bar.set_description(name)
            bar.update()

        for name in tunable():
            best_first[name] = tune(
                name, tries, patients, seed, population=population, workers=workers, progress=progress,
                environment=environment, repetitions=repetitions, **settings,
            )  # fmt: skip
    texts = {Path(FILE).name: _yaml(best_first, population, command), TRIES: _table(best_first, command)}
    for name, text in texts.items():
        with whole_file(folder / name) as file:
            file.write(text)
    for name, ranked in best_first.items():
        best = ranked[0]
        print(f"{name:18} return {best.measures['return']:.1f}  {best.numbers}")
    print(f"written: {folder}")
    return 0


def _yaml(tries: dict[str, list[Try]], population: str, command: str) -> str:
    """Best numbers of each policy, with where they are from."""
    lines = [
        f"# Numbers of the baselines with the best mean return on '{population}', found by",
        f"#   {command}",
        f"# All tries stand in {TRIES}.",
    ]
    for name, ranked in tries.items():
        lines.append(f"{name}:")
        lines += [f"  {key}: {value}" for key, value in ranked[0].numbers.items()]
    return "\n".join(lines) + "\n"


def _table(tries: dict[str, list[Try]], command: str) -> str:
    """All tries, best first."""
    text = io.StringIO()
    text.write(f"# {command}; means over the patients\n")
    rows = csv.writer(text, lineterminator="\n")
    known = [m for m in MEASURED if all(m in one.measures for ranked in tries.values() for one in ranked)]
    rows.writerow(["policy", *known, "numbers"])
    for name, ranked in tries.items():
        for one in ranked:
            numbers = " ".join(f"{key}={value:g}" for key, value in one.numbers.items())
            rows.writerow([name, *(f"{one.measures[m]:.4g}" for m in known), numbers])
    return text.getvalue()

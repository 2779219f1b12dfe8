"""`python -m agents upper-bound`: what the best of many schedules that know the patient reach, as a table."""

from __future__ import annotations

import shlex

import numpy as np
from tqdm import tqdm

from dms_core.command_line import FAILED_RUN, FileOut
from dms_core.errors import Stopped, counted
from dms_core.files.output_file import write_text
from dms_core.files.outputs import OutputFile, Outputs, partial

from ...environment import ENVIRONMENT, PROGRAM
from ...evaluation.comparison.evaluate import check_numbers
from ...evaluation.results.tables import records_text
from ...evaluation.search.upper_bound import Tried, best_together
from ...evaluation.search.upper_bound import upper_bound as bound
from ..options import EnvironmentId, device_settings

WHOLE = ("seed", "repetitions")
"""Columns of whole numbers."""


def upper_bound(
    out: FileOut,
    population: str = "evaluation",
    patients: int = 24,
    repetitions: int = 1,
    seed: int = 0,
    environment: EnvironmentId = ENVIRONMENT,
    exoskeleton: str | None = None,
    overwrite: bool = False,
) -> int:
    """Try 96 schedules of the PID's authority and lag on each patient, and write what the best of them reach.

    Args:
        out: CSV file.
        population: of the patients, by name or YAML file.
        patients: how many.
        repetitions: of the movement in an episode.
        seed: of the patients.
        environment: in which, by id; one with a PID and a reference.
        exoskeleton: device by name or YAML file, or changes of the default one as JSON.
        overwrite: replace a file of this name.
    """
    check_numbers(patients, seed)
    options = f"--population {shlex.quote(population)} --patients {patients} --repetitions {repetitions} --seed {seed}"
    options += _further(environment, exoskeleton)
    settings = {"repetitions": repetitions, "environment": environment, **device_settings(exoskeleton)}
    done: list[Tried] = []
    inputs = [population, exoskeleton]
    with Outputs("upper-bound", files=[OutputFile("--out", out)], inputs=inputs, overwrite=overwrite) as outputs:
        try:
            with tqdm(total=patients, unit="patient", leave=False, disable=None) as bar:

                def progress(one: Tried) -> None:
                    done.append(one)
                    bar.update()

                results, tried = bound(population, patients, seed, progress=progress, **settings)
        except KeyboardInterrupt:
            if not done:
                raise
            write_text(part := partial(out), _table(rows_of(done, repetitions), options))
            raise Stopped(f"{len(done)} of {patients} patients are in '{outputs.where(part)}'.") from None
        write_text(out, _table(rows_of(results, repetitions), options))
    for n in range(1, repetitions + 1):
        whom = f"{counted(patients, 'patient')} of '{population}', {counted(n, 'repetition')}"
        print(f"{whom}, shared schedule {tried[best_together(results, n)].round(2)}, means:")
        print("  " + ", ".join(f"{k} {v:.3g}" for k, v in _means(rows_of(results, repetitions), n).items()))
    print(f"written: {outputs.where(out)}")
    return FAILED_RUN if outputs.failed else 0


def _further(environment: str, exoskeleton: str | None) -> str:
    """Options that are not the usual ones, as they are typed."""
    options = f" --env {environment}" if environment != ENVIRONMENT else ""
    return options + (f" --exoskeleton {shlex.quote(exoskeleton)}" if exoskeleton else "")


def _means(rows: list[dict[str, float]], repetitions: int) -> dict[str, float]:
    """Means of what was measured with a number of repetitions, over the patients."""
    chosen = [row for row in rows if row["repetitions"] == repetitions]
    measured = [column for column in rows[0] if column not in ("seed", "ability", "repetitions")]
    return {column: float(np.mean([row[column] for row in chosen])) for column in measured}


def rows_of(results: list[Tried], repetitions: int) -> list[dict[str, float]]:
    """A row for each patient and each number of repetitions."""
    counts = range(1, repetitions + 1)
    shared = [best_together(results, n) for n in counts]
    return [one.row(best, n) for one in results for n, best in zip(counts, shared, strict=True)]


def _table(rows: list[dict[str, float]], options: str) -> str:
    """Rows as CSV, below a line with the command."""
    records = [{k: v if k in WHOLE else f"{v:.4g}" for k, v in row.items()} for row in rows]
    return records_text(records, f"{PROGRAM} upper-bound {options}")

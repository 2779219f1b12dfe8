"""`python -m agents upper-bound`: what the best of many schedules that know the patient reach, as a table."""

from __future__ import annotations

import csv
import io
import shlex
from typing import Annotated

import numpy as np
from tqdm import tqdm
from tyro.conf import arg

from dms_core.command_line import FAILED_RUN, FileOut
from dms_core.errors import Stopped
from dms_core.output_file import one_line, write_text
from dms_core.outputs import OutputFile, Outputs, partial

from ..environment import ENVIRONMENT, PROGRAM
from ..evaluation.evaluate import check_numbers
from ..evaluation.upper_bound import Tried, best_together
from ..evaluation.upper_bound import upper_bound as bound
from .options import device_settings

TABLE = rb"\A# python -m \w+ upper-bound "
"""Mark of the files that this command wrote, as a regular expression."""
WHOLE = ("seed", "repetitions")
"""Columns of whole numbers."""


def upper_bound(
    out: FileOut,
    population: str = "evaluation",
    patients: int = 24,
    repetitions: int = 1,
    seed: int = 0,
    environment: Annotated[str, arg(name="env", metavar="ID")] = ENVIRONMENT,
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
        overwrite: replace a file of this name that this command did not write.
    """
    check_numbers(patients, seed)
    options = f"--population {population} --patients {patients} --repetitions {repetitions} --seed {seed}"
    options += f" --env {environment}" if environment != ENVIRONMENT else ""
    options += f" --exoskeleton {shlex.quote(exoskeleton)}" if exoskeleton else ""
    file, done = OutputFile("--out", out, TABLE), list[Tried]()
    with Outputs("upper-bound", files=[file], inputs=[population, exoskeleton], overwrite=overwrite) as outputs:
        try:
            with tqdm(total=patients, unit="patient", leave=False, disable=None) as bar:

                def progress(one: Tried) -> None:
                    done.append(one)
                    bar.update()

                results, tried = bound(
                    population, patients, seed, repetitions=repetitions, environment=environment, progress=progress,
                    **device_settings(exoskeleton),
                )  # fmt: skip
        except KeyboardInterrupt:
            if not done:
                raise
            write_text(part := partial(out), _table(rows_of(done, repetitions), options))
            raise Stopped(f"{len(done)} of {patients} patients are in '{outputs.where(part)}'.") from None
        rows = rows_of(results, repetitions)
        write_text(out, _table(rows, options))
    for n in range(1, repetitions + 1):
        means = {
            c: float(np.mean([row[c] for row in rows if row["repetitions"] == n]))
            for c in rows[0]
            if c not in ("seed", "ability", "repetitions")
        }
        best = tried[best_together(results, n)].round(2)
        print(f"{patients} patients of '{population}', {n} repetitions, shared schedule {best}, means:")
        print("  " + ", ".join(f"{k} {v:.3g}" for k, v in means.items()))
    print(f"written: {outputs.where(out)}")
    return FAILED_RUN if outputs.failed else 0


def rows_of(results: list[Tried], repetitions: int) -> list[dict[str, float]]:
    """A row for each patient and each number of repetitions."""
    counts = range(1, repetitions + 1)
    shared = [best_together(results, n) for n in counts]
    return [one.row(best, n) for one in results for n, best in zip(counts, shared, strict=True)]


def _table(rows: list[dict[str, float]], options: str) -> str:
    """Rows as CSV, below a line with the command."""
    text = io.StringIO()
    text.write(f"# {PROGRAM} upper-bound {one_line(options)}\n")
    writer = csv.DictWriter(text, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows({k: v if k in WHOLE else f"{v:.4g}" for k, v in row.items()} for row in rows)
    return text.getvalue()

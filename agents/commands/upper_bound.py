"""`python -m agents upper-bound`: what the best of many schedules that know the patient reach, as a table."""

from __future__ import annotations

import csv
import shlex
from pathlib import Path
from typing import Annotated

import numpy as np
from tqdm import tqdm
from tyro.conf import arg

from dms_core.output_file import check_writable, whole_file

from ..environment import ENVIRONMENT, PROGRAM
from ..evaluation.evaluate import check_numbers
from ..evaluation.upper_bound import best_together
from ..evaluation.upper_bound import upper_bound as bound
from .options import device_settings

WHOLE = ("seed", "repetitions")
"""Columns of whole numbers."""


def upper_bound(
    out: Path,
    population: str = "evaluation",
    patients: int = 24,
    repetitions: int = 1,
    seed: int = 0,
    environment: Annotated[str, arg(name="env", metavar="ID")] = ENVIRONMENT,
    exoskeleton: str | None = None,
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
    """
    check_numbers(patients, seed)
    check_writable(out)
    with tqdm(total=patients, unit="patient", leave=False, disable=None) as bar:
        results, tried = bound(
            population, patients, seed, repetitions=repetitions, environment=environment, progress=bar.update,
            **device_settings(exoskeleton),
        )  # fmt: skip
    counts = range(1, repetitions + 1)
    shared = [best_together(results, n) for n in counts]
    rows = [one.row(best, n) for one in results for n, best in zip(counts, shared, strict=True)]
    options = f"--population {population} --patients {patients} --repetitions {repetitions} --seed {seed}"
    options += f" --env {environment}" if environment != ENVIRONMENT else ""
    options += f" --exoskeleton {shlex.quote(exoskeleton)}" if exoskeleton else ""
    with whole_file(out) as file:
        file.write(f"# {PROGRAM} upper-bound {options}\n")
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows({k: v if k in WHOLE else f"{v:.4g}" for k, v in row.items()} for row in rows)
    for n, best in zip(counts, shared, strict=True):
        means = {
            c: float(np.mean([row[c] for row in rows if row["repetitions"] == n]))
            for c in rows[0]
            if c not in ("seed", "ability", "repetitions")
        }
        print(f"{patients} patients of '{population}', {n} repetitions, shared schedule {tried[best].round(2)}, means:")
        print("  " + ", ".join(f"{k} {v:.3g}" for k, v in means.items()))
    print(f"written: {out}")
    return 0

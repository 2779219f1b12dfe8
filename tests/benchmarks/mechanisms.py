"""The stress test: random closed mechanisms that can move, each run by two methods and beside a neighbouring motion.

    OMP_NUM_THREADS=1 python tests/benchmarks/mechanisms.py [--first 0] [--count 300] [--t-end 5] [--out CSV]

Families and what is asked of each are in tests/dms_core/mechanisms. A seed is one mechanism; the table has a line for
each, with how both runs ended, the largest change of energy over the largest kinetic energy, and the largest distance
between the two methods, over that to the solution whose start velocities differ by 1e-4 of themselves, until these two
have parted by 0.05 m. 300 of them take about half an hour of one core.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.dms_core.mechanisms.study import ENERGY, FINE, Row, study


def written(value: object) -> str:
    """A cell of the table."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def main(arguments: Sequence[str] | None = None) -> int:
    """Study the mechanisms, write the table, say how many ran; 1 if fewer than 29 in 30 did or one is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--count", type=int, default=300, help="number of mechanisms")
    parser.add_argument("--t-end", type=float, default=5.0, help="[s]")
    parser.add_argument("--out", type=Path, default=Path("mechanisms.csv"), help="the table")
    asked = parser.parse_args(arguments)
    finished = wrong = 0
    with asked.out.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(Row._fields)
        for seed in range(asked.first, asked.first + asked.count):
            row = study(seed, asked.t_end)
            finished += row.finished
            wrong += row.energy > ENERGY or row.difference > FINE
            writer.writerow(written(x) for x in row)
            file.flush()
            print(" ".join(written(x) for x in row), flush=True)
    print(f"{finished} of {asked.count} ran to {asked.t_end} s by both methods; {wrong} lost energy or differ.")
    return int(finished < asked.count * 29 / 30 or wrong > 0)


if __name__ == "__main__":
    sys.exit(main())

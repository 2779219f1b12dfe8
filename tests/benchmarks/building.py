"""How the cost of building a model grows with its bodies: the hanging chain of N links, CPU time.

    OMP_NUM_THREADS=1 python tests/benchmarks/building.py [--links 125 250 500 1000] [--repeats 3]

A build is everything from declarations to a model that can be run: layout, start, rank of the joints, orders of
elimination. With a dense rank it grew as the cube; up to 1,000 links the slope should stay below 1.5. On a machine that
others use, only the ratios mean something.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from dms_core import Model
from tests.benchmarks.problems import chain

STEEPEST = 1.5
"""Slope of log cost over log size allowed between the smallest and the largest."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print seconds, ratio and slope from one size to the next; 1 if the whole slope is too steep."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--links", type=int, nargs="+", default=[125, 250, 500, 1000], help="sizes, ascending")
    parser.add_argument("--repeats", type=int, default=3, help="the quickest of so many counts")
    asked = parser.parse_args(arguments)
    Model(chain(2))
    costs: list[float] = []
    for links in asked.links:
        times = []
        for _ in range(asked.repeats):
            system, begun = chain(links), time.process_time()
            Model(system)
            times.append(time.process_time() - begun)
        costs.append(min(times))
        ratio = f"{costs[-1] / costs[-2]:.2f} times" if len(costs) > 1 else ""
        print(f"{links:6d} links {costs[-1]:8.2f} s {ratio}", flush=True)
    slope = math.log(costs[-1] / costs[0]) / math.log(asked.links[-1] / asked.links[0])
    print(f"slope {slope:.2f}")
    return int(slope > STEEPEST)


if __name__ == "__main__":
    sys.exit(main())

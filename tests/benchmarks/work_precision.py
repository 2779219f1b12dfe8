"""Error against cost, ours beside other programs: a log-log picture and the numbers behind it.

    python tests/benchmarks/work_precision.py [--out docs]

Ours: CPU time of one thread, scaled by calibration.py, and the error at the end time or, of the elbow angle, the
largest over time, against a run at a hundredth of the finest tolerance. Others: peers.csv, measured on another day with
the same calibration. Their systems are not the same in every detail; peers.csv says what each is.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from dms_core import Model, Simulation, SolverOptions, simulate
from dms_core.model import Constant
from exo_env.arm26 import bare_arm
from exo_env.human import MUSCLES
from exo_env.scenarios import build, load_scenarios
from tests.benchmarks.bench import ARM, CHAIN_TIP, chain, tip
from tests.benchmarks.calibration import normalised

PEERS = Path(__file__).parent / "peers.csv"
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
STEPS = (4e-3, 2e-3, 1e-3, 5e-4)
Row = tuple[str, str, float, float]


def angle_rows(system: str, model: Model, seconds: float) -> list[Row]:
    """(system, setting, error [rad], ms of CPU a simulated second) of each tolerance."""
    grid = np.linspace(0.0, seconds, 201)
    exact = simulate(model, seconds, SolverOptions(rtol=TOLERANCES[-1] * 1e-2)).sensors(grid)["elbow_angle.angle"]
    found: list[Row] = []
    for rtol in TOLERANCES:

        def run(rtol: float = rtol) -> Simulation:
            simulation = Simulation(model, SolverOptions(rtol=rtol))
            simulation.advance(seconds)
            return simulation

        cpu, simulation = normalised(run, 3)
        error = np.abs(simulation.trajectory().sensors(grid)["elbow_angle.angle"] - exact).max()
        found.append((system, f"rtol={rtol:g}", float(error), cpu / seconds * 1e3))
    return found


def chain_rows(links: int) -> list[Row]:
    """(system, setting, error of the tip [m], ms of CPU for a second) of each step."""
    model, found = Model(chain(links)), list[Row]()
    for h in STEPS:

        def run(h: float = h) -> Simulation:
            simulation = Simulation(model, SolverOptions(fixed_step=h))
            simulation.advance(1.0)
            return simulation

        cpu, simulation = normalised(run, 3)
        error = float(np.hypot(*(tip(simulation, links) - CHAIN_TIP[links])))
        found.append((f"chain {links}", f"h={h:g}", error, cpu * 1e3))
    return found


def ours() -> list[Row]:
    """All of our rows."""
    exercise, scenarios = load_scenarios()
    model, _ = build(scenarios[2], exercise)
    rows = angle_rows("elbow", model, exercise.duration)
    start, excitations, _ = ARM["co-contract"]
    commands = {muscle: Constant(value=excitations[muscle[:3]]) for muscle in MUSCLES}
    rows += angle_rows("arm26 co-contract", Model(bare_arm(start, commands, 0.02)), 1.0)
    return rows + chain_rows(8)


def theirs() -> list[dict[str, str]]:
    """Rows of peers.csv."""
    with PEERS.open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def draw(path: Path, rows: Sequence[Row], others: Sequence[dict[str, str]]) -> None:
    """A panel a system."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    panels = {"elbow": "whole system, elbow angle [rad]", "arm26 co-contract": "arm26, elbow angle [rad]",
              "chain 8": "chain of 8 links, tip [m]"}  # fmt: skip
    figure, axes = plt.subplots(1, 3, figsize=(12, 4.2), layout="constrained")
    for ax, (system, title) in zip(axes, panels.items(), strict=True):
        mine = [(r[2], r[3]) for r in rows if r[0] == system]
        ax.loglog(*zip(*mine, strict=True), "o-", color="#0b6e4f", lw=2, label="exo-env")
        groups: dict[str, list[tuple[float, float]]] = {}
        for r in others:
            if r["system"] == system and "Dense" not in r["setting"] and "dense" not in r["setting"]:
                kind = r["setting"].split(" accuracy")[0].split(" h=")[0]
                groups.setdefault(f"{r['program']}, {kind}", []).append((float(r["error"]), float(r["ms"])))
        for k, (name, points) in enumerate(groups.items()):
            style = "s^vDP*"[k % 6] + ("--" if len(points) > 1 else "")
            ax.loglog(*zip(*sorted(points), strict=True), style, lw=1, ms=5, alpha=0.8, label=name)
        ax.set(title=title, xlabel="error", ylabel="CPU ms a simulated second")
        # Room for the legend below the curves.
        ax.set_ylim(bottom=0.15 * min(ms for _, ms in mine))
        ax.grid(True, which="major", alpha=0.3)
        ax.legend(fontsize=6.5, loc="lower left")
    figure.savefig(path, dpi=110)


def main(arguments: list[str] | None = None) -> None:
    """Measure, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of work_precision.png and .csv")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)
    rows = ours()
    with (out / "work_precision.csv").open("w", newline="") as file:
        file.write("# python tests/benchmarks/work_precision.py\n")
        writer = csv.writer(file)
        writer.writerow(["system", "setting", "error", "ms"])
        writer.writerows((r[0], r[1], f"{r[2]:.3g}", f"{r[3]:.4g}") for r in rows)
    for row in rows:
        print(f"{row[0]:18} {row[1]:12} {row[2]:9.1e} {row[3]:8.2f} ms")
    draw(out / "work_precision.png", rows, theirs())


if __name__ == "__main__":
    main()

"""Error against cost, ours beside other programs: a log-log picture and the numbers behind it.

    python tests/benchmarks/work_precision.py [--out docs]

Ours: CPU time of one thread, scaled by calibration.py, and the error at the end time or, of the elbow angle, the
largest over time, against a run at a hundredth of the finest tolerance. Others: out/bench/peers.json where
`make bench-peers` has written it, else peers.csv, both with the same calibration. Their systems are not the same in
every detail: Exudyn's whole system is a comparable, simpler one of 8 bodies, OpenSim's arm has wrapping surfaces.
MuJoCo keeps joints by soft equalities, so that they open; how far is in the legend and beside its times. Its minimal
coordinates, which only a tree has, are in the table and not in the picture.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from dms_core import Model, Simulation, SolverOptions, simulate
from dms_core.figures import drawn
from exo_env.rendering.panels import COLOURS, panels, save
from exo_env.rendering.quantities import quantity
from tests.benchmarks import csv_file
from tests.benchmarks.calibration import normalised
from tests.benchmarks.peer_table import MEASURED, Figure, PeerTable
from tests.benchmarks.problems import ANGLE, arm, chain, chain_error, chain_gap, whole_system

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
STEPS = (4e-3, 2e-3, 1e-3, 5e-4)
CHAIN = 8
PANELS = {"elbow": ("whole system", "error of the elbow angle [rad]"),
          "arm26 co-contract": ("arm26", "error of the elbow angle [rad]"),
          f"chain {CHAIN}": (f"chain of {CHAIN} links", "error of the tip's place [m]")}  # fmt: skip
"""Title of each system's panel, and its error in words."""
OURS = "exo-env"


def angle_rows(system: str, model: Model, seconds: float, repeats: int) -> list[Figure]:
    """Error [rad] and ms of CPU a simulated second of each tolerance."""
    grid = np.linspace(0.0, seconds, 201)
    exact = simulate(model, seconds, SolverOptions(rtol=TOLERANCES[-1] * 1e-2)).sensors(grid)[ANGLE]
    found = []
    for rtol in TOLERANCES:

        def run(rtol: float = rtol) -> Simulation:
            simulation = Simulation(model, SolverOptions(rtol=rtol))
            simulation.advance(seconds)
            return simulation

        cpu, simulation = normalised(run, repeats)
        error = float(np.abs(simulation.trajectory().sensors(grid)[ANGLE] - exact).max())
        found.append(Figure(system, OURS, f"rtol={rtol:g}", error, cpu / seconds * 1e3, math.nan))
    return found


def chain_rows(links: int, repeats: int) -> list[Figure]:
    """Error of the tip [m] and ms of CPU for a second of each step."""
    model, found = Model(chain(links)), []
    for h in STEPS:

        def run(h: float = h) -> Simulation:
            simulation = Simulation(model, SolverOptions(fixed_step=h))
            simulation.advance(1.0)
            return simulation

        cpu, simulation = normalised(run, repeats)
        error, gap = chain_error(simulation, links), chain_gap(simulation)
        found.append(Figure(f"chain {links}", OURS, f"h={h:g}", error, cpu * 1e3, gap))
    return found


def ours(repeats: int) -> list[Figure]:
    """All of our rows."""
    model, seconds = whole_system()
    rows = angle_rows("elbow", model, seconds, repeats)
    return rows + angle_rows("arm26 co-contract", arm("co-contract"), 1.0, repeats) + chain_rows(CHAIN, repeats)


def curves(figures: Sequence[Figure]) -> dict[str, list[Figure]]:
    """Those of other programs by what the legend calls them; dense solvers are slower here, and a tree is no chain."""
    found: dict[str, list[Figure]] = {}
    for f in figures:
        if "ense" not in f.setting and "tree" not in f.setting:
            kind = f.setting.partition(" accuracy")[0].partition(" h=")[0]
            found.setdefault(f"{f.program}, {kind}", []).append(f)
    for name in list(found):
        gap = max(f.gap_m for f in found[name])
        # Below a micrometre joints count as closed.
        if gap > 1e-6:
            found[f"{name} (joints open by {quantity(gap, 'm', 1)})"] = found.pop(name)
    return found


@drawn
def draw(path: Path, figures: Sequence[Figure]) -> None:
    """A panel a system, its legend below it."""
    figure, axes = panels(1, len(PANELS), (12.0, 5.2))
    for ax, (system, (title, error)) in zip(axes.flat, PANELS.items(), strict=True):
        here = [f for f in figures if f.system == system]
        mine = [(f.error, f.ms) for f in here if f.program == OURS]
        ax.loglog(*zip(*mine, strict=True), "o-", color=COLOURS[-1], lw=2, label=OURS)
        for k, (name, ones) in enumerate(curves([f for f in here if f.program != OURS]).items()):
            points = sorted((f.error, f.ms) for f in ones)
            style = "s^vDP*"[k % 6] + ("--" if len(points) > 1 else "")
            ax.loglog(*zip(*points, strict=True), style, color=COLOURS[k % 6], lw=1, ms=5, alpha=0.8, label=name)
        ax.set(title=title, xlabel=error, ylabel="CPU time per simulated second [ms]")
        ax.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.17), frameon=False)
    save(figure, path)


def main(arguments: list[str] | None = None) -> None:
    """Measure, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of work_precision.png and .csv")
    parser.add_argument("--peers", type=Path, default=MEASURED, help="figures of other programs")
    parser.add_argument("--repeats", type=int, default=3, help="of each timing; the median counts")
    given = parser.parse_args(arguments)
    peers, rows = PeerTable(given.peers), ours(given.repeats)
    shown = [*rows, *(f for system in PANELS for f in peers.of(system))]
    columns = ("system", "program", "setting", "error", "ms", "gap_m")
    csv_file.write(given.out / "work_precision.csv", columns,
                   [[getattr(f, name) for name in columns] for f in shown])  # fmt: skip
    for f in sorted(shown, key=lambda f: list(PANELS).index(f.system)):
        gap = "" if math.isnan(f.gap_m) else f"  joints open by {f.gap_m:.0e} m"
        print(f"{f.system:18} {f.program:16} {f.setting:36} {f.error:9.1e} {f.ms:8.2f} ms{gap}")
    for system in PANELS:
        print(f"others of {system}: {peers.origin(system)}")
    draw(given.out / "work_precision.png", shown)


if __name__ == "__main__":
    main()

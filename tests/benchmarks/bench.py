"""Speed of the core beside other programs, as tables.

    python tests/benchmarks/bench.py [--quick]

CPU seconds of one thread, scaled by calibration.py. Figures of the others are those that `make bench-peers` left in
out/bench/peers.json, else those of peers.csv; each table says which.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from dms_core import Model, Simulation, SolverOptions, simulate
from tests.benchmarks import csv_file
from tests.benchmarks.calibration import normalised
from tests.benchmarks.chain_reference import TIP
from tests.benchmarks.peer_table import MEASURED, Figure, PeerTable, cost_at
from tests.benchmarks.problems import ANGLE, ARM_TASKS, arm, chain, chain_error, chain_gap, whole_system

TARGET = 1e-4
"""Error at which costs are compared [rad]."""
Row = tuple[str, str, float, float, float]
"""System, setting, error, ms, gap [m]."""


def bench_chain(sizes: list[int], peers: PeerTable) -> list[Row]:
    """N-link chain, 1 s at a fixed step of 1 ms."""
    versions = sorted({f.program for f in peers.of("chain 8")})
    print(f"\nChain of N links, h = 1 ms, 1 s, redundant coordinates; others: {', '.join(versions)}, the cheaper of")
    print("Exudyn's two solvers, and MuJoCo's soft equalities with its own stiffness, whose joints open by `gap`")
    print(f"    others {peers.origin('chain 8')}")
    other = f"{'us/step':>7} {'tip m':>8} {'gap m':>8} {'ratio':>6}"
    print(f"{'N':>4} {'ours us':>9} {'us/link':>7} {'tip m':>8} {'gap m':>8} | Exudyn: {other} | MuJoCo: {other}")
    rows: list[Row] = []
    for links in sizes:
        model = Model(chain(links))

        def run(simulation: Simulation) -> Simulation:
            simulation.advance(1.0)
            return simulation

        def prepare(model: Model = model) -> Simulation:
            return Simulation(model, SolverOptions(fixed_step=1e-3))

        run(prepare())
        seconds, simulation = normalised(run, 5 if links < 32 else 3, prepare=prepare)
        us, error, gap = seconds * 1e3, chain_error(simulation, links), chain_gap(simulation)
        rows.append((f"chain {links}", "h=0.001", error, us, gap))
        others = "".join(
            _beside(peers.of(f"chain {links}", name), us) for name in ("Exudyn h=0.001", "MuJoCo solref=0.02 h=0.001")
        )
        print(f"{links:4d} {us:9.1f} {us / links:7.2f} {error:8.1e} {gap:8.1e}{others}", flush=True)
    return rows


def _beside(figures: list[Figure], us: float) -> str:
    """The cheapest figure, and its cost over ours."""
    if not figures:
        return f" | {'-':>15} {'-':>8} {'-':>8} {'-':>6}"
    best = min(figures, key=lambda f: f.ms)
    return f" | {best.ms:15.1f} {best.error:8.1e} {best.gap_m:8.1e} {best.ms / us:6.2f}"


def bench_precision(title: str, system: str, model: Model, seconds: float, tolerances: list[float],
                    peers: PeerTable) -> list[Row]:  # fmt: skip
    """Error of the elbow's angle against cost, per simulated second."""
    print(f"\n{title}")
    print(
        f"{'rtol':>8} {'error rad':>10} {'ms CPU / s':>11} {'steps / s':>10} {'iterations':>11} {'factorisations':>15}"
    )
    grid = np.linspace(0.0, seconds, 201)
    exact = simulate(model, seconds, SolverOptions(rtol=tolerances[-1] * 1e-2)).sensors(grid)[ANGLE]
    rows: list[Row] = []
    for rtol in tolerances:

        def run(rtol: float = rtol) -> Simulation:
            simulation = Simulation(model, SolverOptions(rtol=rtol))
            simulation.advance(seconds)
            return simulation

        cpu, simulation = normalised(run)
        error = float(np.abs(simulation.trajectory().sensors(grid)[ANGLE] - exact).max())
        rows.append((system, f"rtol={rtol:g}", error, cpu / seconds * 1e3, math.nan))
        s = simulation.stats()
        print(f"{rtol:8.0e} {error:10.1e} {cpu / seconds * 1e3:11.2f} {s.steps / seconds:10.0f} "
              f"{s.newton_iterations:11d} {s.factorisations:15d}")  # fmt: skip
    compare(system, rows, peers)
    return rows


def compare(system: str, rows: list[Row], peers: PeerTable) -> None:
    """Costs at the target error, log-log between settings; a cheapest run that is more exact is not made cheaper."""
    ours, figures = cost_at([(r[2], r[3]) for r in rows], TARGET), peers.of(system)
    print(f"    at {TARGET:g} rad: ours {ours:.2f} ms a simulated second; others {peers.origin(system)}")
    for program in sorted({f.program for f in figures}):
        mine = [f for f in figures if f.program == program]
        for kind in sorted({_kind(f) for f in mine}):
            ms = cost_at([(f.error, f.ms) for f in mine if _kind(f) == kind], TARGET)
            said = "never as exact" if math.isnan(ms) else f"{ms:8.1f} ms, ratio {ms / ours:6.1f}"
            print(f"    {program}, {kind:28} {said}")


def _kind(figure: Figure) -> str:
    """A setting without its step or accuracy."""
    return figure.setting.partition(" accuracy")[0].partition(" h=")[0]


def main(arguments: list[str] | None = None) -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer sizes and tolerances")
    parser.add_argument("--peers", type=Path, default=MEASURED, help="figures of other programs")
    parser.add_argument("--out", type=Path, help="a CSV of our rows")
    given = parser.parse_args(arguments)
    peers, quick = PeerTable(given.peers), given.quick
    rows = bench_chain([1, 8] if quick else list(TIP), peers)
    for task in ARM_TASKS:
        tolerances = [1e-4, 1e-5] if quick else [1e-3, 1e-4, 1e-5, 1e-6, 1e-7]
        title = f"arm26, {task}, straight through via points (OpenSim's has wrapping surfaces)"
        rows += bench_precision(title, f"arm26 {task}", arm(task), 1.0, tolerances, peers)
    model, seconds = whole_system()
    title = "Subject, exoskeleton and gym machine, scenario 3 (Exudyn: a comparable, simpler system of 8 bodies)"
    tolerances = [1e-2, 1e-3] if quick else [1e-2, 1e-3, 1e-4, 1e-5, 1e-6]
    rows += bench_precision(title, "elbow", model, seconds, tolerances, peers)
    if given.out:
        csv_file.write(given.out, ("system", "setting", "error", "ms", "gap_m"), rows)


if __name__ == "__main__":
    main()

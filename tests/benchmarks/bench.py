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
from tests.benchmarks import flexible_reference as flexible
from tests.benchmarks.calibration import normalised
from tests.benchmarks.chain_reference import TIP
from tests.benchmarks.peer_table import MEASURED, Figure, PeerTable, cost_at
from tests.benchmarks.problems import (
    ANGLE,
    ARM_TASKS,
    arm,
    beam,
    chain,
    chain_error,
    chain_gap,
    node_error,
    slider_crank,
    whole_system,
)

TARGET = 1e-4
"""Error at which costs are compared [rad]."""
BEAM_TARGET, CRANK_TARGET = 2e-4, 5e-6
"""The same for a place of the flexible mechanisms [m]: 32 elements leave 9e-5 by themselves."""
METHODS = ("bdf2", "sdirk2", "radau5")
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


def bench_flexible(quick: bool, peers: PeerTable) -> list[Row]:
    """Beam of 32 elements and slider-crank, by each method; then steps of 1 ms over the number of elements."""
    n, tolerances = flexible.BEAM_ELEMENTS, [1e-2, 1e-3] if quick else [1e-1, 1e-2, 1e-3, 1e-4]
    print(f"\nBeam of {n} elements, 1 s, in space (Exudyn: in the plane)")
    rows = _flexible(f"beam {n}", Model(beam(n)), f"boom.node{n}", tolerances, (4e-3, 2e-3, 1e-3))
    compare(f"beam {n}", rows, peers, BEAM_TARGET, "m")
    print("\nSlider-crank with a flexible rod of 4 elements, 0.2 s, in space (Exudyn: in the plane)")
    rod = _flexible("slider-crank", Model(slider_crank(4)), "rod.node2", tolerances[:3], (4e-4, 2e-4, 1e-4))
    rows += rod
    compare("slider-crank", rod, peers, CRANK_TARGET, "m")
    print(f"\nBeam, bdf2 at h = 1 ms; Exudyn's trapezoidal rule with linear elements\n    {peers.origin('growth 8')}")
    print(f"{'elements':>8} {'ours us/step':>13} {'tip m':>8} | {'Exudyn us/step':>14} {'tip m':>8} {'ratio':>6}")
    for n in [8, 32] if quick else [4, 8, 16, 32, 64]:
        seconds, error = _swing(Model(beam(n)), SolverOptions(fixed_step=1e-3), f"boom.node{n}")
        rows.append((f"growth {n}", "h=0.001", error, seconds * 1e3, math.nan))
        other = "".join(f" | {f.ms:14.1f} {f.error:8.1e} {f.ms / seconds / 1e3:6.2f}" for f in peers.of(f"growth {n}"))
        print(f"{n:8d} {seconds * 1e3:13.1f} {error:8.1e}{other}", flush=True)
    return rows


def _swing(model: Model, options: SolverOptions, node: str) -> tuple[float, float]:
    """Normalised CPU seconds a simulated second, and the error of a node at the end [m]."""
    is_beam = model.system.name == "beam"
    seconds = flexible.BEAM_SECONDS if is_beam else flexible.CRANK_SECONDS

    def run(simulation: Simulation) -> Simulation:
        if not simulation.advance(seconds):
            raise RuntimeError(f"{model.system.name}: the solver failed")
        return simulation

    used, simulation = normalised(run, 3, prepare=lambda: Simulation(model, options))
    return used / seconds, node_error(simulation, node, flexible.BEAM_TIP if is_beam else flexible.ROD_MIDDLE)


def _flexible(system: str, model: Model, node: str, tolerances: list[float], steps: tuple[float, ...]) -> list[Row]:
    """Rows of one model by all methods, with error control and in steps of one size [s]."""
    rows: list[Row] = []
    for method in METHODS:
        options = [(f"rtol={x:g}", SolverOptions(method=method, rtol=x)) for x in tolerances]
        options += [(f"h={x:g}", SolverOptions(method=method, fixed_step=x)) for x in steps]
        for said, chosen in options:
            seconds, error = _swing(model, chosen, node)
            rows.append((system, f"{method} {said}", error, seconds * 1e3, math.nan))
            print(f"{rows[-1][1]:28} {error:10.1e} m {seconds * 1e3:11.2f} ms CPU / s", flush=True)
    return rows


def compare(system: str, rows: list[Row], peers: PeerTable, target: float = TARGET, unit: str = "rad") -> None:
    """Costs at the target error, log-log between settings; a cheapest run that is more exact is not made cheaper."""
    ours, figures = cost_at([(r[2], r[3]) for r in rows], target), peers.of(system)
    print(f"    at {target:g} {unit}: ours {ours:.2f} ms a simulated second; others {peers.origin(system)}")
    for program in sorted({f.program for f in figures}):
        mine = [f for f in figures if f.program == program]
        for kind in sorted({_kind(f) for f in mine}):
            ms = cost_at([(f.error, f.ms) for f in mine if _kind(f) == kind], target)
            said = "never as exact" if math.isnan(ms) else f"{ms:8.1f} ms, ratio {ms / ours:6.1f}"
            print(f"    {program}, {kind:28} {said}")


def _kind(figure: Figure) -> str:
    """A setting without its step, accuracy or number of elements."""
    return figure.setting.partition(" accuracy")[0].partition(" h=")[0].partition(" n=")[0]


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
    rows += bench_flexible(quick, peers)
    if given.out:
        csv_file.write(given.out, ("system", "setting", "error", "ms", "gap_m"), rows)


if __name__ == "__main__":
    main()

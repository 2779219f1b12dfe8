"""Speed of the core beside published or measured figures of other programs, as tables.

    python tests/benchmarks/bench.py [--quick]

CPU seconds of one thread, scaled by calibration.py. The figures of Exudyn 1.13.6 and OpenSim 4.6 were taken on another
day with the same calibration on a shared two-core machine (their scripts time the same systems; see each table).
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from dms_core import Model, Simulation, SolverOptions, System, simulate
from dms_core.model import Constant, Gravity, Revolute, RigidBody
from exo_env.arm26 import bare_arm
from exo_env.human import MUSCLES
from exo_env.scenarios import build, load_scenarios
from tests.benchmarks.calibration import normalised

CHAIN_TIP = {
    1: (-0.999966588072, -0.008174517717),
    2: (-1.662115135816, -1.041466637193),
    4: (-1.001231213963, -3.607961551270),
    8: (5.183553317252, -4.878764572808),
    16: (14.037422088005, -4.905051600163),
    32: (30.530246507830, -4.905000000057),
    64: (62.869093243961, -4.905000000000),
}
"""Tip of the chain at 1 s [m], from an independent formulation integrated to 1e-12."""
CHAIN_EXUDYN = {1: (12.2, 1.8e-6), 2: (25.0, 3.9e-6), 4: (47.8, 1.5e-5), 8: (91.8, 1.0e-5), 16: (178.7, 4.0e-7),
                32: (335.9, 4.2e-8), 64: (695.9, 1.0e-7)}  # fmt: skip
"""Exudyn's better solver, redundant coordinates, sparse: (us a step, tip error [m])."""
ARM = {
    "co-contract": (1.0, {"TRI": 0.10, "BIC": 0.15, "BRA": 0.15}, "58.9 ms at 1.4e-5 rad"),
    "flex": (0.5, {"TRI": 0.02, "BIC": 0.08, "BRA": 0.08}, "56.4 ms at 8.4e-6 rad"),
}
"""Start angle [rad], excitations, and OpenSim's cheapest run at about 1e-5 rad (CPodes, with wrapping surfaces)."""


def chain(links: int) -> System:
    """Thin rods of 1 m and 1 kg, hinged to each other and to the ground, horizontal and at rest."""
    bodies = [
        RigidBody(name=f"link{i}", mass=1.0, inertia=(1e-3, 1 / 12, 1 / 12), position=(i + 0.5, 0.0, 0.0))
        for i in range(links)
    ]
    hinges = [
        Revolute(name=f"hinge{i}", body_i=f"link{i - 1}" if i else "ground", body_j=f"link{i}",
                 point_i=(0.5, 0.0, 0.0) if i else (0.0, 0.0, 0.0), point_j=(-0.5, 0.0, 0.0))
        for i in range(links)
    ]  # fmt: skip
    return System("chain", bodies=bodies, constraints=hinges, forces=[Gravity(name="g", acceleration=(0, -9.81, 0))])


def tip(simulation: Simulation, links: int) -> np.ndarray:
    """Position of the last link's free end [m]."""
    q = simulation.state.q[7 * (links - 1) : 7 * links]
    angle = 2.0 * math.atan2(q[6], q[3])
    return q[:2] + 0.5 * np.array([math.cos(angle), math.sin(angle)])


def bench_chain(sizes: list[int]) -> None:
    """N-link chain, 1 s at a fixed step of 1 ms."""
    print("\nChain of N links, h = 1 ms, 1 s (Exudyn: the better of its two index-2/3 solvers)")
    print(
        f"{'N':>4} {'us/step':>9} {'us/link/step':>13} {'tip error m':>12} "
        f"{'Exudyn us/step':>15} {'error m':>9} {'ratio':>6}"
    )
    for links in sizes:
        model = Model(chain(links))

        def run(model: Model = model) -> Simulation:
            simulation = Simulation(model, SolverOptions(fixed_step=1e-3))
            simulation.advance(1.0)
            return simulation

        run()
        seconds, simulation = normalised(run, 5 if links < 32 else 3)
        error = float(np.hypot(*(tip(simulation, links) - CHAIN_TIP[links])))
        us, (peer, peer_error) = seconds * 1e3, CHAIN_EXUDYN[links]
        print(f"{links:4d} {us:9.1f} {us / links:13.2f} {error:12.1e} {peer:15.1f} {peer_error:9.1e} {peer / us:6.1f}")


def bench_precision(title: str, model: Model, angle: str, seconds: float, tolerances: list[float], peer: str) -> None:
    """Error of an angle against cost, per simulated second."""
    print(f"\n{title}\n    another program: {peer}")
    print(
        f"{'rtol':>8} {'error rad':>10} {'ms CPU / s':>11} {'steps / s':>10} {'iterations':>11} {'factorisations':>15}"
    )
    grid = np.linspace(0.0, seconds, 201)
    exact = simulate(model, seconds, SolverOptions(rtol=tolerances[-1] * 1e-2)).sensors(grid)[angle]
    for rtol in tolerances:

        def run(rtol: float = rtol) -> Simulation:
            simulation = Simulation(model, SolverOptions(rtol=rtol))
            simulation.advance(seconds)
            return simulation

        cpu, simulation = normalised(run)
        error = np.abs(simulation.trajectory().sensors(grid)[angle] - exact).max()
        s = simulation.stats()
        print(f"{rtol:8.0e} {error:10.1e} {cpu / seconds * 1e3:11.1f} {s.steps / seconds:10.0f} "
              f"{s.newton_iterations:11d} {s.factorisations:15d}")  # fmt: skip


def bench_arm(tolerances: list[float]) -> None:
    """arm26 alone, elbow free, six muscles."""
    for name, (start, excitations, peer) in ARM.items():
        commands = {muscle: Constant(value=excitations[muscle[:3]]) for muscle in MUSCLES}
        model = Model(bare_arm(start, commands, 0.02))
        bench_precision(f"arm26, {name}, via points", model, "elbow_angle.angle", 1.0, tolerances, f"OpenSim {peer}")


def bench_system(tolerances: list[float]) -> None:
    """The full system of scenario 3."""
    exercise, scenarios = load_scenarios()
    model, _ = build(scenarios[2], exercise)
    peer = "Exudyn, a comparable system of 8 bodies: 68 ms at 1.2e-4 rad"
    title = "Subject, exoskeleton and gym machine, scenario 3"
    bench_precision(title, model, "elbow_angle.angle", exercise.duration, tolerances, peer)


def main(arguments: list[str] | None = None) -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer sizes and tolerances")
    quick = parser.parse_args(arguments).quick
    tasks: list[Callable[[], None]] = [
        lambda: bench_chain([1, 8] if quick else list(CHAIN_TIP)),
        lambda: bench_arm([1e-5, 1e-6] if quick else [1e-3, 1e-4, 1e-5, 1e-6, 1e-7]),
        lambda: bench_system([1e-4] if quick else [1e-3, 1e-4, 1e-5, 1e-6]),
    ]
    for task in tasks:
        task()


if __name__ == "__main__":
    main()

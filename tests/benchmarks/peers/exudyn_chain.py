"""The chain of chain_reference.py in Exudyn: redundant coordinates, sparse LU, modified Newton, both index-2/3 solvers.

A link is a rigid body of Euler parameters (7 coordinates, 1 equation) and a hinge (5 equations): 13 N unknowns. Newton
tolerances are Exudyn's own, 1e-8 relative and 1e-10 absolute; the spectral radius of generalized-alpha is 0.8; nothing
is written while solving, and setting up is not timed.

    .venv-peers/exu/bin/python tests/benchmarks/peers/exudyn_chain.py [--links 1 8 64] [--json FILE]
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[3]))

import exudyn as exu
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia

from tests.benchmarks.calibration import normalised
from tests.benchmarks.chain_reference import TIP
from tests.benchmarks.peers.record import Row, parser, row, save

PROGRAM = f"Exudyn {exu.__version__}"
SOLVERS = {"trap2": exu.DynamicSolverType.TrapezoidalIndex2, "genalpha": exu.DynamicSolverType.GeneralizedAlpha}
STEP, STEPS, CURVE_LINKS = 1e-3, (4e-3, 2e-3, 1e-3, 5e-4), 8
"""Step of every chain [s], and those of the one whose error against cost is wanted."""


def chain(links: int) -> tuple[Any, list[Any]]:
    """The assembled system and its bodies."""
    system = exu.SystemContainer().AddSystem()
    before, bodies = system.CreateGround(referencePosition=[0, 0, 0]), []
    inertia = RigidBodyInertia(mass=1.0, inertiaTensor=np.diag([1e-3, 1 / 12, 1 / 12]))
    for i in range(links):
        body = system.CreateRigidBody(
            referencePosition=[i + 0.5, 0, 0], inertia=inertia, gravity=[0, -9.81, 0],
            nodeType=exu.NodeType.RotationEulerParameters,
        )  # fmt: skip
        system.CreateRevoluteJoint(itemNumbers=[before, body], position=[i, 0, 0], axis=[0, 0, 1], useGlobalFrame=True)
        before = body
        bodies.append(body)
    system.Assemble()
    return system, bodies


def settings(step: float, seconds: float, linear: str = "EigenSparse") -> exu.SimulationSettings:
    """Settings of a run at a fixed step [s]."""
    found = exu.SimulationSettings()
    found.timeIntegration.numberOfSteps = round(seconds / step)
    found.timeIntegration.endTime = seconds
    found.timeIntegration.verboseMode = 0
    found.timeIntegration.newton.useModifiedNewton = True
    found.timeIntegration.generalizedAlpha.spectralRadius = 0.8
    found.solution.file.write = False
    found.parallel.numberOfThreads = 1
    found.linearSolver.solverType = getattr(exu.LinearSolverType, linear)
    if linear == "EigenSparse":
        found.linearSolver.reuseAnalyzedPattern = True
    return found


def ends(system: Any, bodies: list[Any], side: float) -> np.ndarray:
    """Right (0.5) or left (-0.5) ends of the links [m], shape (links, 3)."""
    where = exu.OutputVariableType.Position
    return np.array([system.GetObjectOutputBody(b, where, localPosition=[side, 0, 0]) for b in bodies])


def measure(links: int, solver: str, step: float, repeats: int) -> Row:
    """One chain, one solver, one step."""

    def run(given: tuple[Any, list[Any]]) -> tuple[Any, list[Any]]:
        if not given[0].SolveDynamic(settings(step, 1.0), solverType=SOLVERS[solver]):
            raise RuntimeError(f"{links} links, {solver}: the solver failed")
        return given

    seconds, (system, bodies) = normalised(run, repeats, prepare=lambda: chain(links))
    right, left = ends(system, bodies, 0.5), ends(system, bodies, -0.5)
    error = float(np.hypot(*(right[-1, :2] - TIP[links])))
    gap = float(np.abs(left - np.vstack([np.zeros(3), right[:-1]])).max())
    return row(f"chain {links}", PROGRAM, f"{solver} h={step:g}", seconds, error=error, gap=gap)


def main() -> None:
    """Time all chains."""
    found = parser(__doc__)
    found.add_argument("--links", type=int, nargs="*", choices=list(TIP), default=list(TIP))
    given = found.parse_args()
    exu.config.printToConsole = False
    cases = [(n, h) for n in given.links for h in (STEPS if n == CURVE_LINKS else (STEP,))]
    save(given.json, [measure(n, solver, h, given.repeats) for solver in SOLVERS for n, h in cases])


if __name__ == "__main__":
    main()

"""A system of the size of the elbow with its exoskeleton in Exudyn: 8 bodies in redundant coordinates, 1 s.

Upper arm, forearm, two links of the exoskeleton, elbow pulley, motor pulley, hand load and cable weight: 56
coordinates, 44 equations of joints, 8 of Euler parameters, 4 degrees of freedom. A cuff, two elastic cables over
guides, and six muscles as springs with a constant force (Exudyn has no Hill muscle): comparable to ours, not equal, and
simpler. Planar layout, axis z, gravity -y.

    .venv-peers/exu/bin/python tests/benchmarks/peers/exudyn_elbow.py [--json FILE]

Error: of the forearm's angle at 1 s against Exudyn's own run at a step of 2e-5 s.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[3]))

import exudyn as exu
import numpy as np
from exudyn.itemInterface import MarkerBodyRigid, ObjectConnectorReevingSystemSprings
from exudyn.rigidBodyUtilities import RigidBodyInertia

from tests.benchmarks.calibration import normalised
from tests.benchmarks.peers.exudyn_chain import PROGRAM, SOLVERS, settings
from tests.benchmarks.peers.record import Row, parser, row, save

UPPER, FORE, SIDE = 0.29, 0.27, 0.06
"""Lengths of upper arm and forearm, and the exoskeleton's distance beside them [m]."""
ELBOW = np.array([0.0, -UPPER, 0.0])
STEPS, EXACT_STEP = (4e-3, 2e-3, 1e-3, 5e-4), 2e-5
BODIES = {
    "upper": (1.864, (0.0148, 0.0045, 0.0131), (0.0, -UPPER / 2, 0.0)),
    "fore": (1.534, (0.0016, 0.0193, 0.0200), ELBOW + [FORE / 2, 0.0, 0.0]),
    "exo_upper": (0.35, (0.002, 0.0004, 0.002), (0.0, -UPPER / 2, SIDE)),
    "exo_fore": (0.30, (0.0003, 0.0015, 0.0015), ELBOW + [0.10, 0.0, SIDE]),
    "pulley": (0.08, (4e-5, 4e-5, 7e-5), ELBOW + [0.0, 0.0, SIDE]),
    "motor": (0.20, (1e-4, 1e-4, 2e-4), (-0.15, 0.10, SIDE)),
    "load": (1.0, (4e-4, 4e-4, 4e-4), ELBOW + [FORE, 0.0, 0.0]),
    "weight": (0.5, (2e-4, 2e-4, 2e-4), (-0.30, -0.30, SIDE)),
}
"""Mass [kg], principal inertia [kg m^2], position [m]."""


class Muscle(NamedTuple):
    """A line from the upper arm to the forearm."""

    force: float
    """Largest [N]."""
    origin: tuple[float, float, float]
    """On the upper arm [m]."""
    insertion: tuple[float, float, float]
    """On the forearm [m]."""
    activation: float
    """[-]."""


MUSCLES = (
    Muscle(798.5, (0.0, 0.12, 0.0), (-0.115, -0.024, 0.0), 0.02),
    Muscle(624.3, (-0.005, 0.05, 0.0), (-0.115, -0.024, 0.005), 0.02),
    Muscle(624.3, (-0.005, 0.0, 0.0), (-0.115, -0.024, -0.005), 0.02),
    Muscle(624.3, (0.02, 0.14, 0.0), (-0.09, 0.01, 0.0), 0.10),
    Muscle(435.6, (0.02, 0.14, 0.01), (-0.09, 0.01, 0.005), 0.10),
    Muscle(987.3, (0.01, -0.03, 0.0), (-0.105, 0.008, 0.0), 0.10),
)


def add_bodies(system: Any) -> dict[str, Any]:
    """All bodies, by name."""
    found = {"ground": system.CreateGround(referencePosition=[0, 0, 0])}
    for name, (mass, inertia, position) in BODIES.items():
        found[name] = system.CreateRigidBody(
            referencePosition=list(position), inertia=RigidBodyInertia(mass=mass, inertiaTensor=np.diag(inertia)),
            gravity=[0, -9.81, 0], nodeType=exu.NodeType.RotationEulerParameters,
        )  # fmt: skip
    return found


def add_joints(system: Any, body: dict[str, Any]) -> None:
    """Welds, hinges and a slide."""
    beside = ELBOW + [0.0, 0.0, SIDE]
    for a, b, point in (("ground", "upper", (0.0, 0.0, 0.0)), ("upper", "exo_upper", (0.0, -UPPER / 2, SIDE)),
                        ("exo_fore", "pulley", beside), ("fore", "load", ELBOW + [FORE, 0.0, 0.0])):  # fmt: skip
        system.CreateGenericJoint(
            itemNumbers=[body[a], body[b]], position=list(point), constrainedAxes=[1] * 6, useGlobalFrame=True
        )
    for a, b, point in (("upper", "fore", ELBOW), ("exo_upper", "exo_fore", beside),
                        ("ground", "motor", BODIES["motor"][2])):  # fmt: skip
        system.CreateRevoluteJoint(
            itemNumbers=[body[a], body[b]], position=list(point), axis=[0, 0, 1], useGlobalFrame=True
        )
    system.CreatePrismaticJoint(
        itemNumbers=[body["ground"], body["weight"]], position=list(BODIES["weight"][2]), axis=[0, 1, 0],
        useGlobalFrame=True,
    )  # fmt: skip


def add_forces(system: Any, body: dict[str, Any]) -> None:
    """Cuff, damping of two hinges, muscles."""
    system.CreateCartesianSpringDamper(
        itemNumbers=[body["fore"], body["exo_fore"]], localPosition0=[0.16 - FORE / 2, 0, SIDE],
        localPosition1=[0.06, 0, 0], stiffness=[5e3] * 3, damping=[20.0] * 3,
    )  # fmt: skip
    for a, b, point, damping in (("upper", "fore", ELBOW, 0.5), ("ground", "motor", BODIES["motor"][2], 0.01)):
        system.CreateTorsionalSpringDamper(
            itemNumbers=[body[a], body[b]], position=list(point), axis=[0, 0, 1], stiffness=0.0, damping=damping,
            useGlobalFrame=True,
        )  # fmt: skip
    for m in MUSCLES:
        start = np.array(BODIES["upper"][2]) + m.origin
        length = float(np.linalg.norm(np.array(BODIES["fore"][2]) + m.insertion - start))
        system.CreateSpringDamper(
            itemNumbers=[body["upper"], body["fore"]], localPosition0=list(m.origin), localPosition1=list(m.insertion),
            referenceLength=length, stiffness=0.3 * m.force / length, damping=0.05 * m.force,
            force=m.activation * m.force,
        )  # fmt: skip


def add_cable(system: Any, points: Sequence[tuple[Any, Sequence[float], Sequence[float]]], radii: list[float]) -> None:
    """A cable without slack at first over points of (body, local position, place) [m] with the sheaves' radii [m]."""
    markers = [system.AddMarker(MarkerBodyRigid(bodyNumber=b, localPosition=list(p))) for b, p, _ in points]
    places = np.array([place for _, _, place in points])
    system.AddObject(
        ObjectConnectorReevingSystemSprings(
            markerNumbers=markers, stiffnessPerLength=2e4, dampingPerLength=40.0, regularizationForce=-1.0,
            referenceLength=float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum()), sheavesRadii=radii,
            sheavesAxes=exu.Vector3DList([[0, 0, 1]] * len(points)),
        )
    )  # fmt: skip


def elbow() -> tuple[Any, Any]:
    """The assembled system and its forearm."""
    system = exu.SystemContainer().AddSystem()
    body = add_bodies(system)
    add_joints(system, body)
    add_forces(system, body)
    pull = ((body["exo_fore"], (-0.05, 0.04, 0.0), ELBOW + [0.05, 0.04, SIDE]),
            (body["exo_upper"], (-0.03, 0.10, 0.0), (-0.03, -UPPER / 2 + 0.10, SIDE)),
            (body["motor"], (0.03, 0.0, 0.0), (-0.12, 0.10, SIDE)))  # fmt: skip
    hang = ((body["motor"], (-0.03, 0.0, 0.0), (-0.18, 0.10, SIDE)),
            (body["ground"], (-0.27, 0.10, SIDE), (-0.27, 0.10, SIDE)),
            (body["weight"], (0.0, 0.0, 0.0), (-0.30, -0.30, SIDE)))  # fmt: skip
    add_cable(system, pull, [0.0, 0.0, 0.0])
    add_cable(system, hang, [0.0, 0.02, 0.0])
    system.Assemble()
    return system, body["fore"]


def solved(given: tuple[Any, Any], solver: str, linear: str, step: float) -> float:
    """The forearm's angle at 1 s [rad]."""
    system, fore = given
    if not system.SolveDynamic(settings(step, 1.0, linear), solverType=SOLVERS[solver]):
        raise RuntimeError(f"{solver}, {linear}, h = {step:g}: the solver failed")
    turn = exu.OutputVariableType.RotationMatrix
    A = np.array(system.GetObjectOutputBody(fore, turn, localPosition=[0, 0, 0])).reshape(3, 3)
    return math.atan2(A[1, 0], A[0, 0])


def measure(solver: str, linear: str, step: float, exact: float, repeats: int) -> Row:
    """One solver at one step."""
    seconds, angle = normalised(lambda given: solved(given, solver, linear, step), repeats, prepare=elbow)
    return row("elbow", PROGRAM, f"{solver} {linear} h={step:g}", seconds, error=abs(angle - exact))


def main() -> None:
    """Time all settings."""
    found = parser(__doc__)
    found.add_argument("--linear", nargs="*", default=["EigenSparse"], help="or EXUdense, EigenDense, both slower here")
    found.add_argument("--steps", type=float, nargs="*", default=list(STEPS), help="[s]")
    given = found.parse_args()
    exu.config.printToConsole = False
    exact = solved(elbow(), "trap2", "EigenSparse", EXACT_STEP)
    cases = [(solver, linear, h) for solver in SOLVERS for linear in given.linear for h in given.steps]
    save(given.json, [measure(*case, exact, given.repeats) for case in cases])


if __name__ == "__main__":
    main()

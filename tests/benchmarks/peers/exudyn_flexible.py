"""The beam and the slider-crank of flexible_reference.py in Exudyn: its geometrically exact beam elements of the plane.

An element has two nodes (linear) or three (quadratic), three coordinates each; ours has seven a node, as it moves in
space. Solvers and Newton tolerances are those of exudyn_chain.py; setting up is not timed.

    .venv-peers/exu/bin/python tests/benchmarks/peers/exudyn_flexible.py [--elements 32] [--json FILE]
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[3]))

import exudyn as exu
import numpy as np
from exudyn.beams import GenerateBeamElementsAlongLine
from exudyn.itemInterface import (
    CoordinateConstraint,
    MarkerBodyPosition,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    MarkerNodePosition,
    NodePointGround,
    NodeRigidBody2D,
    ObjectBeamGeometricallyExact2D,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
    Torque,
)

from tests.benchmarks import flexible_reference as flexible
from tests.benchmarks.calibration import normalised
from tests.benchmarks.peers.exudyn_chain import PROGRAM, SOLVERS, settings
from tests.benchmarks.peers.record import Row, parser, row, save

NODES = {"linear": 2, "quadratic": 3}
BEAM_STEPS, CRANK_STEPS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4), (4e-4, 2e-4, 1e-4, 5e-5)
"""Fixed steps [s]."""
ROD_ELEMENTS = {"trap2": (4, 8), "genalpha": (4,)}
"""With more elements generalized-alpha hardly converges at these steps: nothing damps the rod's stretching."""
GROWTH_STEP = 1e-3
Built = tuple[Any, int]
"""The assembled system and the node whose place is compared."""


def template(section: flexible.RoundSection, nodes: int) -> ObjectBeamGeometricallyExact2D:
    """An element of a section."""
    return ObjectBeamGeometricallyExact2D(
        nodeNumbers=[exu.InvalidIndex()] * nodes, massPerLength=section.density * section.area,
        crossSectionInertia=section.density * section.inertia, bendingStiffness=section.E * section.inertia,
        axialStiffness=section.E * section.area, shearStiffness=section.shear_factor * section.G * section.area,
    )  # fmt: skip


def beam(elements: int, kind: str) -> Built:
    """The beam, and its free end."""
    system = exu.SystemContainer().AddSystem()
    made = GenerateBeamElementsAlongLine(
        system, [0, 0, 0], [flexible.BEAM_LENGTH, 0, 0], elements, template(flexible.RUBBER, NODES[kind]),
        gravity=[0, -flexible.GRAVITY, 0], groundConstraintsStart=[True, True, False],
    )  # fmt: skip
    system.Assemble()
    return system, made["nodes"][-1]


def slider_crank(elements: int, kind: str) -> Built:
    """The slider-crank, and the middle of its rod."""
    system = exu.SystemContainer().AddSystem()
    pin, angle = flexible.rod_start()
    far = [pin[0] + flexible.ROD * math.cos(angle), 0, 0]
    made = GenerateBeamElementsAlongLine(
        system, [*pin, 0], far, elements, template(flexible.STEEL, NODES[kind]),
        groundConstraintsEnd=[False, True, False],
    )  # fmt: skip
    nodes = made["nodes"]
    system.AddObject(ObjectRigidBody2D(nodeNumber=nodes[-1], mass=flexible.SLIDER_MASS, inertia=0.0))
    turning = system.AddNode(NodeRigidBody2D(referenceCoordinates=[0, 0, flexible.START]))
    crank = system.AddObject(ObjectRigidBody2D(nodeNumber=turning, mass=0.1, inertia=flexible.CRANK_INERTIA))
    ground = system.AddMarker(
        MarkerNodeCoordinate(nodeNumber=system.AddNode(NodePointGround(referenceCoordinates=[0, 0, 0])), coordinate=0)
    )
    for k in (0, 1):
        bearing = system.AddMarker(MarkerNodeCoordinate(nodeNumber=turning, coordinate=k))
        system.AddObject(CoordinateConstraint(markerNumbers=[ground, bearing]))
    ends = (
        system.AddMarker(MarkerBodyPosition(bodyNumber=crank, localPosition=[flexible.CRANK, 0, 0])),
        system.AddMarker(MarkerNodePosition(nodeNumber=nodes[0])),
    )
    system.AddObject(ObjectJointRevolute2D(markerNumbers=list(ends)))
    driven = system.AddMarker(MarkerBodyRigid(bodyNumber=crank))
    system.AddLoad(Torque(markerNumber=driven, loadVector=[0, 0, flexible.MOMENT]))
    system.Assemble()
    return system, nodes[len(nodes) // 2]


PROBLEMS = {
    "beam": (beam, flexible.BEAM_SECONDS, flexible.BEAM_TIP),
    "slider-crank": (slider_crank, flexible.CRANK_SECONDS, flexible.ROD_MIDDLE),
}


def place(built: Built) -> np.ndarray:
    """Where the node is now [m], shape (2,)."""
    return np.array(built[0].GetNodeOutput(built[1], exu.OutputVariableType.Position))[:2]


def measure(problem: str, elements: int, kind: str, solver: str, step: float, repeats: int, system: str) -> Row:
    """One problem, one element, one solver, one step; milliseconds a simulated second."""
    build, seconds, end = PROBLEMS[problem]

    def run(built: Built) -> Built:
        if not built[0].SolveDynamic(settings(step, seconds), solverType=SOLVERS[solver]):
            raise RuntimeError(f"{problem} of {elements} elements, {solver}, h = {step:g}: the solver failed")
        return built

    used, built = normalised(run, repeats, prepare=lambda: build(elements, kind))
    error = float(np.hypot(*(place(built) - end)))
    return row(system, PROGRAM, f"{solver} {kind} n={elements} h={step:g}", used / seconds, error=error)


def main() -> None:
    """Time both problems, and the beam over its number of elements."""
    found = parser(__doc__)
    found.add_argument("--elements", type=int, nargs="*", default=[4, 8, 16, 32, 64], help="of the beam at one step")
    given = found.parse_args()
    exu.config.printToConsole = False
    n, rows = flexible.BEAM_ELEMENTS, []
    for solver in SOLVERS:
        for kind in NODES:
            for h in BEAM_STEPS:
                rows.append(measure("beam", n, kind, solver, h, given.repeats, f"beam {n}"))
            for elements in ROD_ELEMENTS[solver]:
                for h in CRANK_STEPS:
                    rows.append(measure("slider-crank", elements, kind, solver, h, given.repeats, "slider-crank"))
    for elements in given.elements:
        rows.append(measure("beam", elements, "linear", "trap2", GROWTH_STEP, given.repeats, f"growth {elements}"))
    save(given.json, rows)


if __name__ == "__main__":
    main()

"""OpenSim's arm26 under constant excitations for 1 s: error of the elbow angle against cost, two integrators.

    .venv-peers/osim/bin/python tests/benchmarks/peers/opensim_arm26.py --model arm26.osim [--json FILE]

The model is Models/Arm26/arm26.osim of github.com/opensim-org/opensim-models, which is not part of this project. Its
shoulder is locked at 0; it has wrapping surfaces, ours runs straight through the points. "elastic tendon" is the model
as it is (Thelen 2003); it has no rigid tendon, so "rigid tendon" is OpenSim's own replacement by DeGrooteFregly2016.

Error: largest over 50 times, against Runge-Kutta-Merson with an accuracy of 1e-10. Setting up is not timed.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[3]))

import numpy as np
import opensim

from tests.benchmarks.calibration import normalised
from tests.benchmarks.peers.record import Row, parser, row, save

PROGRAM = f"OpenSim {opensim.GetVersion().partition('-')[0]}"
TASKS = {
    "co-contract": (1.0, {"TRI": 0.10, "BIC": 0.15, "BRA": 0.15}),
    "flex": (0.5, {"TRI": 0.02, "BIC": 0.08, "BRA": 0.08}),
}
"""Start angle [rad], excitations by the beginning of the muscle's name."""
METHODS = {
    "rkmerson": opensim.Manager.IntegratorMethod_RungeKuttaMerson,
    "cpodes": opensim.Manager.IntegratorMethod_CPodes,
}
ACCURACIES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
TIMES = np.linspace(0.0, 1.0, 51)[1:]
ANGLE = "r_elbow_flex"


def arm(path: Path, task: str, rigid: bool) -> tuple[Any, Any]:
    """Model and start state of a task."""
    model, (angle, excitations) = opensim.Model(str(path)), TASKS[task]
    if rigid:
        opensim.DeGrooteFregly2016Muscle.replaceMuscles(model, True)
    controller, muscles = opensim.PrescribedController(), model.getMuscles()
    controller.setName("constant")
    for i in range(muscles.getSize()):
        muscle = muscles.get(i)
        if rigid:
            muscle.set_ignore_tendon_compliance(True)
        controller.addActuator(muscle)
        name = muscle.getName()
        controller.prescribeControlForActuator(name, opensim.Constant(excitations[name[:3]]))
    model.addController(controller)
    model.finalizeConnections()
    model.getCoordinateSet().get("r_shoulder_elev").set_locked(True)
    state = model.initSystem()
    model.getCoordinateSet().get(ANGLE).setValue(state, angle)
    model.getCoordinateSet().get(ANGLE).setSpeedValue(state, 0.0)
    for i in range(muscles.getSize()):
        muscles.get(i).setActivation(state, 0.02)
    model.equilibrateMuscles(state)
    return model, state


def manager(model: Any, state: Any, method: str, accuracy: float) -> Any:
    """An integrator at the start."""
    found = opensim.Manager(model)
    found.setWriteToStorage(False)
    found.setPerformAnalyses(False)
    found.setIntegratorMethod(METHODS[method])
    found.setIntegratorAccuracy(accuracy)
    found.initialize(opensim.State(state))
    return found


def angles(model: Any, state: Any, method: str, accuracy: float) -> np.ndarray:
    """The elbow's at TIMES [rad]."""
    run, elbow = manager(model, state, method, accuracy), model.getCoordinateSet().get(ANGLE)
    return np.array([elbow.getValue(run.integrate(float(t))) for t in TIMES])


def curve(path: Path, task: str, rigid: bool, repeats: int) -> list[Row]:
    """Error and cost at all accuracies."""
    model, state = arm(path, task, rigid)
    exact, found = angles(model, state, "rkmerson", 1e-10), []
    for method in METHODS:
        for accuracy in ACCURACIES:
            seconds, _ = normalised(
                lambda run: run.integrate(1.0),
                repeats,
                prepare=lambda method=method, accuracy=accuracy: manager(model, state, method, accuracy),
            )
            error = float(np.abs(angles(model, state, method, accuracy) - exact).max())
            setting = f"{method} {'rigid' if rigid else 'elastic'} tendon accuracy={accuracy:g}"
            found.append(row(f"arm26 {task}", PROGRAM, setting, seconds, error=error))
    return found


def main() -> None:
    """Time both tasks."""
    found = parser(__doc__)
    found.add_argument("--model", type=Path, required=True, help="arm26.osim")
    given = found.parse_args()
    opensim.Logger.setLevelString("Off")
    save(given.json, [r for t in TASKS for rigid in (False, True) for r in curve(given.model, t, rigid, given.repeats)])


if __name__ == "__main__":
    main()

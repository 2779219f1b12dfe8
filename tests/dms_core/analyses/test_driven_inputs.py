"""Controllers that read sensors or drive inputs: refused where rates are not known, left out of inverse dynamics."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model, SolverOptions, simulate
from dms_core.analyses import follow_path, inverse_dynamics, kinematic, motion_of, static_equilibrium
from dms_core.errors import ModelError
from dms_core.model import (
    AngleDriver,
    Constant,
    Gravity,
    Input,
    JointAngle,
    JointMotor,
    JointSpringDamper,
    Lines,
    SensorPid,
    StateSpace,
    System,
)
from tests.dms_core.analyses.mechanisms import G, hinge, rod

PID = SensorPid(name="hold", sensor="angle.angle", output="moment", kp=20.0, ki=5.0)
SOURCE = StateSpace(name="source", inputs=("wish",), outputs=("moment",), D=((2.0,),))
OBSERVER = StateSpace(name="observer", sensors=("angle.angle",), A=((-1.0,),), B=((1.0,),))
FILTER = StateSpace(name="filter", inputs=("wish",), A=((-4.0,),), B=((4.0,),))


def arm(*controllers, driver: bool = False, moment: float = 0.0, start: float = -0.3) -> System:
    """A rod with a spring and a motor, whose moment is an input."""
    inputs = [Input(name="moment", signal=Constant(value=moment)), Input(name="wish", signal=Constant(value=0.5))]
    return System(
        "arm",
        bodies=[rod("rod", 0.6, 1.0, angle=start)],
        constraints=[
            hinge("joint", "ground", "rod", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            *([AngleDriver(name="driver", joint="joint", input="course")] if driver else []),
        ],
        forces=[
            *controllers,
            JointMotor(name="motor", joint="joint", input="moment"),
            JointSpringDamper(name="spring", joint="joint", stiffness=9.0, damping=0.5),
            Gravity(name="weight", acceleration=(0.0, -G, 0.0)),
        ],
        sensors=[JointAngle(name="angle", joint="joint")],
        inputs=[*inputs, Input(name="course", signal=Lines(times=(0.0, 1.0), values=(-0.3, 0.4)))],
    )


@pytest.mark.parametrize(
    ("controller", "said"),
    [
        (PID, r"^sensor_pid 'hold' reads 'angle\.angle' by the rate of a state, and at rest all rates are 0"),
        (OBSERVER, r"^state_space 'observer' reads 'angle\.angle' by the rate of a state, .* Expected a model in"),
        (SOURCE, r"^state_space 'source' drives input 'moment' by the rate of a state, and at .*'moment' a signal"),
    ],
)
@pytest.mark.parametrize(
    "analysis", [static_equilibrium, lambda model: follow_path(model, ["moment"])], ids=["static", "path"]
)
@pytest.mark.filterwarnings("ignore::dms_core.errors.ModelWarning")
def test_a_system_at_rest_has_no_readings_and_drives_no_inputs(analysis, controller, said):
    with pytest.raises(ModelError, match=said) as error:
        analysis(Model(arm(controller)))
    assert error.value.element == controller.name


@pytest.mark.filterwarnings("ignore::dms_core.errors.ModelWarning")
def test_states_without_reading_and_output_rest():
    rest = static_equilibrium(Model(arm(FILTER))).states()
    # xdot = -4 x + 4 z, and z = 0.5.
    assert rest.coordinate("filter.x1")[-1] == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize(("controller", "name"), [(PID, "sensor_pid 'hold'"), (SOURCE, "state_space 'source'")])
@pytest.mark.filterwarnings("ignore::dms_core.errors.ModelWarning")
def test_a_driven_motion_does_not_tell_what_a_controller_drives(controller, name):
    said = f"^{name} drives input 'moment' .* states of elements do not follow from positions.*give 'moment' a signal"
    with pytest.raises(ModelError, match=said) as error:
        kinematic(Model(arm(controller, driver=True)), np.linspace(0.0, 1.0, 3))
    assert error.value.element == controller.name


@pytest.mark.filterwarnings("ignore::dms_core.errors.ModelWarning")
def test_the_driver_of_a_motion_stands_for_controller_and_motor():
    controlled = arm(PID)
    run = simulate(Model(controlled), 1.0, SolverOptions(rtol=1e-8)).check()
    times = np.linspace(0.1, 0.9, 17)
    found = inverse_dynamics(controlled, times, motion_of(run, ["angle"], 0.01))
    assert found.left_out == ("hold", "motor")
    # The motor gives what the controller puts out; samples that are differentiated twice err by about 1e-4 rad/s^2.
    np.testing.assert_allclose(found.loads["angle"], run.at(times).rate("hold.output"), atol=1e-3)

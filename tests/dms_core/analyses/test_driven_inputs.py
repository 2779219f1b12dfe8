"""Controllers that read sensors or drive inputs: solved for at rest, refused in driven motions, left out of inverse."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from dms_core import Model, SolverOptions, simulate
from dms_core.analyses import follow_path, inverse_dynamics, kinematic, motion_of, static_equilibrium
from dms_core.errors import InputError, ModelError
from dms_core.model import (
    AngleDriver,
    Constant,
    ElasticRope,
    Gravity,
    Input,
    JointAngle,
    JointMotor,
    JointSpringDamper,
    LineGuide,
    Lines,
    LumpedLoad,
    PathPoint,
    PointMass,
    RopeSensor,
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


MASS, LENGTH, STIFFNESS, DAMPING = 1.0, 0.6, 9.0, 0.5
INERTIA = MASS * LENGTH**2 / 3.0
"""About the joint [kg m^2]."""


def weight_at(angle: float) -> float:
    """Moment of the weight about the joint [N m]."""
    return -MASS * G * 0.5 * LENGTH * math.cos(angle)


def hung(stiffness: float, moment: float) -> float:
    """Angle at which spring, weight and a moment balance [rad]."""
    return brentq(lambda x: moment - stiffness * x + weight_at(x), -1.5, 1.5, xtol=1e-15)


@pytest.mark.filterwarnings("ignore::dms_core.errors.ModelWarning")
class TestAtRest:
    """Signals are rates of states, and what is solved for at rest."""

    def test_an_integrating_controller_rests_at_its_set_point(self):
        """The output is the integral, and carries what spring and weight leave."""
        hold = PID.model_copy(update={"setpoint": 0.4})
        rest = static_equilibrium(Model(arm(hold)))
        states = rest.states()
        wanted = STIFFNESS * 0.4 - weight_at(0.4)
        assert states.sensors()["angle.angle"][-1] == pytest.approx(0.4, abs=1e-11)
        assert states.coordinate("hold.integral")[-1] == pytest.approx(wanted, rel=1e-10)
        assert states.rate("hold.output")[-1] == pytest.approx(wanted, rel=1e-10)
        assert states.rate("hold.reading")[-1] == pytest.approx(0.4, abs=1e-11)
        assert states.coordinate("hold.output")[-1] == 0.0
        point = rest.last.point
        assert point.u[rest.last.model.input_index("moment"), 0] == states.rate("hold.output")[-1]

    def test_it_is_the_rest_that_a_run_in_time_comes_to(self):
        hold = SensorPid(name="hold", sensor="angle.angle", output="moment", kp=4.0, ki=9.0, kd=1.0, rate="angle.rate")
        model = Model(arm(hold))
        rest, run = static_equilibrium(model).states(), simulate(model, 30.0, SolverOptions(rtol=1e-6)).check()
        assert run.sensors([30.0])["angle.angle"][0] == pytest.approx(rest.sensors()["angle.angle"][-1], abs=1e-6)
        assert run.at([30.0]).rate("hold.output")[0] == pytest.approx(rest.rate("hold.output")[-1], rel=1e-5)

    @pytest.mark.parametrize("derivative", [{}, {"kd": 0.7, "filter_time": 0.1}, {"kd": 0.7, "rate": "angle.rate"}])
    def test_without_integral_it_is_a_spring(self, derivative):
        """A proportional controller of 20 N m/rad beside the spring; what differentiates is 0 at rest."""
        hold = SensorPid(name="hold", sensor="angle.angle", output="moment", kp=20.0, **derivative)
        states = static_equilibrium(Model(arm(hold))).states()
        assert states.sensors()["angle.angle"][-1] == pytest.approx(hung(STIFFNESS + 20.0, 0.0), abs=1e-11)

    @pytest.mark.parametrize("limit", [0.5, 2.0])
    def test_a_limited_output_carries_what_it_may(self, limit):
        """The error stays, and back-calculation holds the integral: ki e + (out - raw) / T_t = 0."""
        hold = PID.model_copy(update={"setpoint": 0.4, "highest": limit, "tracking_time": 0.2})
        states = static_equilibrium(Model(arm(hold))).states()
        angle = hung(STIFFNESS, limit)
        assert angle < 0.3
        assert states.sensors()["angle.angle"][-1] == pytest.approx(angle, abs=1e-11)
        raw = limit + 0.2 * 5.0 * (0.4 - angle)
        assert states.coordinate("hold.integral")[-1] == pytest.approx(raw - 20.0 * (0.4 - angle), rel=1e-9)

    def test_blocks_of_sensors_and_inputs(self):
        """xdot = -x + z of an observer; an output of 2 z; both at once."""
        rest = static_equilibrium(Model(arm(OBSERVER, SOURCE))).states()
        angle = hung(STIFFNESS, 1.0)
        assert rest.sensors()["angle.angle"][-1] == pytest.approx(angle, abs=1e-11)
        assert rest.coordinate("observer.x1")[-1] == pytest.approx(angle, abs=1e-11)
        assert rest.rate("source.output1")[-1] == pytest.approx(1.0, abs=1e-12)

    def test_a_load_of_a_beam_or_rope_is_read_at_rest(self):
        """A rope's tension is led to 7 N by the force on the mass that it holds."""
        path = (PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="mass", point=(0.0, 0.0, 0.0)))
        system = System(
            "cell", bodies=[PointMass(name="mass", mass=1.0, position=(0.9, 0.0, 0.0))],
            constraints=[LineGuide(name="track", body_j="mass", axis_i=(1.0, 0.0, 0.0))],
            forces=[
                ElasticRope(name="rope", path=path, axial_stiffness=400.0, damping=9.0, free_length=0.8),
                LumpedLoad(name="pull", body="mass", force=(1.0, 0.0, 0.0), input="force"),
                SensorPid(name="loop", sensor="cell", output="force", ki=3.0, setpoint=7.0),
            ],
            sensors=[RopeSensor(name="cell", rope="rope", components=("tension",))], inputs=[Input(name="force")],
        )  # fmt: skip
        states = static_equilibrium(Model(system)).states()
        assert states.sensors()["cell"][-1] == pytest.approx(7.0, rel=1e-10)
        assert states.coordinate("mass.x")[-1] == pytest.approx(0.8 * (1.0 + 7.0 / 400.0), rel=1e-10)
        assert states.rate("loop.output")[-1] == pytest.approx(7.0, rel=1e-10)

    def test_loads_that_grow(self):
        """Load steps and the path of a proportional controller under its weight: each an equilibrium of its own."""
        hold = SensorPid(name="hold", sensor="angle.angle", output="moment", kp=20.0)
        stepped = static_equilibrium(Model(arm(hold)), loads=["weight"], steps=3)
        path = follow_path(Model(arm(hold)), ["weight"], longest=0.2)
        for found in (stepped, path):
            states = found.states()
            for load, angle in zip(found.loads, states.sensors()["angle.angle"], strict=True):
                wanted = brentq(lambda x, s=load: -29.0 * x + s * weight_at(x), -1.5, 1.5, xtol=1e-15)
                assert angle == pytest.approx(wanted, abs=1e-9)
        assert path.reached and len(path.points) > 3

    def test_its_eigenvalues_are_those_of_the_closed_loop(self):
        """J s^3 + (c + kd) s^2 + (k + k_weight + kp) s + ki = 0, and no state more."""
        hold = SensorPid(
            name="hold", sensor="angle.angle", output="moment", kp=20.0, ki=5.0, kd=1.0, rate="angle.rate", setpoint=0.2
        )
        last = static_equilibrium(Model(arm(hold))).last
        assert last.linearisation.states == ("q.rod.p3", "v.rod.p3", "q.hold.integral")
        k = STIFFNESS - MASS * G * 0.5 * LENGTH * math.sin(0.2)
        wanted = np.roots([INERTIA, DAMPING + 1.0, k + 20.0, 5.0])
        np.testing.assert_allclose(np.sort_complex(last.linearisation.eigenvalues), np.sort_complex(wanted), rtol=1e-8)
        assert last.stable and last.growth == pytest.approx(wanted.real.max(), rel=1e-8)

    def test_an_input_that_is_driven_is_no_load_and_has_no_value(self):
        for settings in ({"loads": ["moment"]}, {"inputs": {"moment": 1.0}}):
            with pytest.raises(InputError, match="input 'moment' is driven by 'hold'. Expected an input that"):
                static_equilibrium(Model(arm(PID)), **settings)


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

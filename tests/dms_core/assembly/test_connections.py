"""Sensors that elements read, and inputs that they drive: derivatives of the whole, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import InputError, ModelError
from dms_core.model import (
    ContactSensor,
    CoordinateSensor,
    CylinderContact,
    CylinderPairContact,
    DcMotor,
    DelayedError,
    ElasticRope,
    Gravity,
    Input,
    JointAngle,
    JointMoment,
    JointReaction,
    LumpedLoad,
    PathPoint,
    Pid,
    Point,
    PointMass,
    Revolute,
    RigidBody,
    RopeForce,
    RopeLength,
    RopeSensor,
    SensorPid,
    SphereContact,
    SphereCylinderContact,
    SpherePairContact,
    StateSpace,
    System,
    Winch,
)
from dms_core.model.signals import Constant, Steps
from dms_core.simulation.dynamics import SolverOptions, World, simulate

TO_BALL = (PathPoint(point=(0.2, 1.0, 0.1)), PathPoint(body="ball", point=(0.0, 0.0, 0.0)))
PATH = (PathPoint(point=(0.0, 1.5, 0.0)), PathPoint(body="arm", point=(0.5, 0.1, 0.0)))


def arm(*, forces=(), sensors=(), inputs=(), constraints=()) -> System:
    """A pendulum about z with a mass beside it."""
    body = RigidBody(
        name="arm", mass=1.2, inertia=(0.02, 0.1, 0.1), position=(0.3, 0.0, 0.0), angular_velocity=(0.0, 0.0, 0.4),
        velocity=(0.0, 0.12, 0.0),
    )  # fmt: skip
    ball = PointMass(name="ball", mass=0.4, position=(0.1, -0.2, 0.3), velocity=(0.2, 0.1, -0.3))
    hinge = Revolute(name="hinge", body_j="arm", point_i=(0.0, 0.0, 0.0))
    return System(
        "arm", bodies=[body, ball], constraints=[hinge, *constraints], forces=forces,
        sensors=[JointAngle(name="angle", joint="hinge"), Point(name="at", body="ball"), *sensors],
        inputs=[Input(name=u) if isinstance(u, str) else u for u in inputs],
    )  # fmt: skip


def pid(**changes) -> SensorPid:
    return SensorPid(**{"name": "pid", "sensor": "angle.angle", "output": "pull", "kp": 40.0, **changes})


def everything() -> System:
    """Readings of angles, accelerations, a tension that is driven itself; loads, ropes, motors, contacts driven."""
    return arm(
        forces=[
            Gravity(name="weight"),
            pid(ki=3.0, kd=2.0, rate="angle.rate", offset=70.0, reference="wish"),
            RopeForce(name="rope", path=PATH, input="pull"),
            SensorPid(
                name="second", sensor="cell", output="push", kp=0.3, ki=1.0, setpoint=30.0, kd=0.1, filter_time=0.2
            ),
            LumpedLoad(name="load", body="arm", point=(0.4, 0.0, 0.0), force=(1.0, 2.0, 3.0), input="push"),
            StateSpace(
                name="block", sensors=("at.acceleration.y", "angle.rate"), inputs=("push", "wish"),
                outputs=("volts", "speed"), A=((-1.0,),), B=((0.1, 0.2, 0.3, 0.4),), C=((1.0,), (0.2,)),
                D=((0.01, 0.2, 0.1, 0.0), (0.0, 0.1, 0.0, 1.0)), start=(0.3,),
            ),
            DcMotor(name="motor", joint="hinge", voltage="volts", resistance=1.0, inductance=0.2, torque_constant=0.3),
            SphereContact(name="touch", body_j="ball", radius=0.5, stiffness=9.0, restitution=0.97,
                          impact_speed_input="speed"),
            SpherePairContact(
                name="pair", body_i="arm", body_j="ball", radius_i=0.3, radius_j=0.3, stiffness=90.0, friction=0.2,
                slip_speed=0.1,
            ),
            CylinderContact(
                name="roller", body_j="arm", point_i=(0.0, 0.5, 0.0), normal_i=(0.1, 1.0, 0.2), axis_j=(0.3, 0.2, 1.0),
                radius=0.2, length=0.3, stiffness=30.0, friction=0.2, slip_speed=0.1,
            ),
            SphereCylinderContact(
                name="bar", body_i="arm", body_j="ball", axis_i=(0.3, 0.2, 1.0), radius_i=0.3, length_i=0.9,
                radius_j=0.3, stiffness=60.0, friction=0.2, slip_speed=0.1,
            ),
            CylinderPairContact(
                name="bars", body_i="arm", body_j="ball", axis_i=(0.3, 0.2, 1.0), radius_i=0.3, length_i=0.9,
                axis_j=(1.0, 0.1, 0.2), radius_j=0.3, length_j=0.4, stiffness=60.0, friction=0.2, slip_speed=0.1,
            ),
            ElasticRope(name="tether", path=TO_BALL, axial_stiffness=20.0, free_length=0.8, damping=0.5),
            Winch(
                name="hoist", joint="hinge", radius=0.1, path=TO_BALL, axial_stiffness=20.0, free_length=0.7,
                damping=0.5,
            ),
        ],
        sensors=[
            RopeSensor(name="cell", rope="rope", components=("tension",)),
            ContactSensor(name="gap", contact="touch"),
            ContactSensor(name="bar_gap", contact="bar"),
            CoordinateSensor(name="current", coordinate="motor.current"),
        ],
        inputs=["pull", "push", "volts", "speed", Input(name="wish", signal=Constant(value=2.0))],
    )  # fmt: skip


def _differences(f: Any, x: np.ndarray, h: float = 1e-6) -> np.ndarray:
    """Central differences of a vector function, shape (m, n)."""
    columns = []
    for k in range(len(x)):
        e = np.zeros(len(x))
        e[k] = h
        columns.append((f(x + e) - f(x - e)) / (2.0 * h))
    return np.stack(columns, axis=-1)


@pytest.fixture(scope="module")
def world() -> World:
    world = World(Model(everything()))
    world.advance(0.02)
    assert world.settle().name == "SUCCESS"
    return world


def test_derivatives_of_the_whole_are_differences(world):
    """Through sensors into controllers, and through driven inputs into forces and sensors."""
    at = world.operating_point()
    b = world.blocks(at)
    for name, field in (("q", "r2_q"), ("v", "r2_v"), ("a", "r2_a")):
        x = getattr(at, name)
        numeric = _differences(lambda y, name=name: world.blocks(at._replace(**{name: y})).r2, x)
        analytic = getattr(b, field).toarray()
        assert np.abs(analytic - numeric).max() < 1e-6 * max(1.0, np.abs(numeric).max()), name
    s = world.sensor_blocks(at)
    for name in ("q", "v", "a"):
        numeric = _differences(lambda y, name=name: world.sensor_blocks(at._replace(**{name: y})).y, getattr(at, name))
        assert np.abs(getattr(s, name) - numeric).max() < 1e-6 * max(1.0, np.abs(numeric).max()), name
    # The tension reads the first controller's output, the impact's speed the block's.
    layout = world.model.layout
    tension = [name for name, _ in layout.outputs].index("cell")
    assert s.v[tension, layout.index["pid.output"]] == 1.0


def test_driven_inputs_move_nothing_by_themselves(world):
    """What a caller writes into their place is not read, and derivatives by them are 0; others are what they were."""
    at = world.operating_point()
    b = world.blocks(at)
    index = world.model.layout.input_index
    assert np.abs(b.r2_u[:, [index[n] for n in ("pull", "push", "volts", "speed")]]).max() == 0.0
    other = at.u.copy()
    other[: len(index) - 1] += 5.0
    np.testing.assert_array_equal(world.blocks(at._replace(u=other)).r2, b.r2)
    k = index["wish"]

    def by_wish(value: np.ndarray) -> np.ndarray:
        u = at.u.copy()
        u[k, 0] = value[0]
        return world.blocks(at._replace(u=u)).r2

    assert np.abs(b.r2_u[:, k, 0] - _differences(by_wish, at.u[k, :1])[:, 0]).max() < 1e-7
    assert b.differenced == ()


def test_the_newton_matrix_is_that_of_the_blocks(world):
    at = world.operating_point()
    x = np.random.default_rng(0).normal(size=2 * (world.model.n_q + world.model.n_phi))
    again = world.blocks(at).newton(80.0) @ world.newton_matrix(80.0, at).solve(x)
    assert np.abs(again - x).max() < 1e-6


@pytest.mark.parametrize(
    ("element", "number"),
    [("pid", "kp"), ("second", "filter_time"), ("block", "A.0.0"), ("block", "D.0.1"), ("motor", "gear_ratio"),
     ("motor", "rotor_inertia"), ("touch", "radius"), ("pair", "friction"), ("roller", "radius"),
     ("bar", "radius_i"), ("bar", "axis_i.1"), ("hoist", "radius"),
     ("tether", "free_length"), ("rope", "path.0.point.1"), ("arm", "mass")],
)  # fmt: skip
def test_derivatives_by_numbers_are_those_of_two_models(world, element, number):
    """A number of a rope moves the controller that reads its tension only through the sensor, which the rope drives."""
    at, system, h = world.operating_point(), world.model.system, 1e-5

    def moved(value: Any, keys: list[str], change: float) -> Any:
        if not keys:
            return value + change
        if isinstance(value, tuple):
            return tuple(moved(x, keys[1:], change) if k == int(keys[0]) else x for k, x in enumerate(value))
        return value.model_copy(update={keys[0]: moved(getattr(value, keys[0]), keys[1:], change)})

    def rows(change: float) -> np.ndarray:
        norms = sum(b.rigid for b in system.bodies)
        lists = [system.bodies, system.constraints[norms:], system.forces, system.sensors, system.inputs]
        lists = [[moved(e, number.split("."), change) if e.name == element else e for e in some] for some in lists]
        names = ("bodies", "constraints", "forces", "sensors", "inputs")
        other = World(Model(System("other", **dict(zip(names, lists, strict=True))), like=world.model))
        return other.blocks(at).r2

    numeric = (rows(h) - rows(-h)) / (2.0 * h)
    found = world.parameter_blocks(element, number).r2
    assert np.abs(found - numeric).max() < 1e-6 * max(1.0, np.abs(numeric).max())
    assert np.abs(numeric).max() > 0.0


def test_an_operating_point_holds_what_is_driven(world):
    at, layout = world.operating_point(), world.model.layout
    for name, coordinate in layout.driven.items():
        assert at.u[layout.input_index[name], 0] == at.v[layout.index[coordinate]]
    y = dict(zip([n for n, _ in layout.outputs], world.read(), strict=True))
    assert y["bar_gap.normal"] > 0.1
    # All contacts press and both ropes pull: nothing above is a derivative of 0.
    assert y["gap.normal"] > 0.1 and y["gap.gap"] < -0.1 and at.u[layout.input_index["speed"], 0] > 0.1
    assert at.v[layout.index["pid.reading"]] == pytest.approx(y["angle.angle"], abs=1e-9)
    assert at.v[layout.index["second.reading"]] == pytest.approx(y["cell"], rel=1e-9)
    assert at.v[layout.index["block.reading1"]] == pytest.approx(y["at.acceleration.y"], rel=1e-9)
    wanted = 70.0 + 40.0 * (2.0 - y["angle.angle"]) + at.q[layout.index["pid.integral"]] - 2.0 * y["angle.rate"]
    assert y["cell"] == pytest.approx(wanted, rel=1e-8)


def test_a_negative_drive_of_a_rope_is_flagged():
    """The rope pulls nothing, and the result says so, as for any input."""
    system = arm(forces=[pid(offset=-50.0), RopeForce(name="rope", path=PATH, input="pull")], inputs=["pull"])
    run = simulate(system, 0.1).check()
    assert [(f.element, f.kind) for f in run.flags] == [("rope", "rope_force")]
    assert run.flags[0].worst < -40.0
    world = World(Model(system))
    world.settle()
    assert [f.element for f in world.flags()] == ["rope"]


def test_a_driven_input_cannot_be_set():
    world = World(Model(arm(forces=[pid(), RopeForce(name="rope", path=PATH, input="pull")], inputs=["pull"])))
    with pytest.raises(InputError, match="input 'pull' is driven by 'pid'"):
        world.set_input("pull", 1.0)


def test_a_system_without_connections_has_the_calls_that_it_had():
    model = Model(arm(forces=[RopeForce(name="rope", path=PATH, input="pull")], inputs=["pull"]))
    assert model.layout.driven == {} and model.new_work().Ju.shape[0] == 0
    assert all(c.sensor is None and not c.placement.wired for c in (*model.layout.dynamics, *model.layout.sensors))


ROPE = RopeForce(name="rope", path=PATH, input="pull")
FIXED = RopeLength(name="fixed", path=PATH)
WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no such sensor": (
        {"forces": [pid(sensor="angle.degrees"), ROPE]},
        r"sensor_pid 'pid': sensor component 'angle.degrees' does not exist. Declared: angle.acceleration, angle.angle",
    ),
    "the sensor without its component": (
        {"forces": [pid(sensor="angle"), ROPE]},
        "sensor_pid 'pid': sensor component 'angle' does not exist",
    ),
    "no such rate": (
        {"forces": [pid(kd=1.0, rate="angle.speed"), ROPE]},
        "sensor_pid 'pid': sensor component 'angle.speed' does not exist",
    ),
    "no such output": (
        {"forces": [pid(output="pul"), ROPE]},
        "sensor_pid 'pid': input 'pul' does not exist. Declared: pull",
    ),
    "no such reference": (
        {"forces": [pid(reference="psi"), ROPE]},
        "sensor_pid 'pid': input 'psi' does not exist. Declared: pull",
    ),
    "two writers": (
        {"forces": [pid(), ROPE, pid(name="other")]},
        r"sensor_pid 'other': input 'pull' is driven by sensor_pid 'pid' already. Expected one writer",
    ),
    "two writers in one block": (
        {"forces": [ROPE, pid(), StateSpace(name="b", outputs=("pull",), D=((),))]},
        "input 'pull' is driven by sensor_pid 'pid' already",
    ),
    "a signal of its own": (
        {"forces": [pid(), ROPE], "inputs": [Input(name="pull", signal=Steps(times=(0.0,), values=(1.0,)))]},
        r"sensor_pid 'pid': input 'pull' has a course in time of its own \(steps\)",
    ),
    "a value of its own": (
        {"forces": [pid(), ROPE], "inputs": [Input(name="pull", signal=Constant(value=1.0))]},
        r"input 'pull' has a course in time of its own \(constant\)",
    ),
    "a constraint that would be driven": (
        {"forces": [pid()], "constraints": [RopeLength(name="fixed", path=PATH, input="pull")]},
        "rope_length 'fixed': input 'pull' is driven by 'pid'. Expected an input with a course in time, as",
    ),
    "a controller that needs the rate": (
        {"forces": [pid(), Pid(name="old", joint="hinge", reference="pull", kp=1.0)]},
        "pid 'old': input 'pull' is driven by 'pid', whose rate is not known",
    ),
    "a reaction": (
        {"forces": [pid(sensor="load.Fx"), ROPE],
         "sensors": [JointReaction(name="load", constraint="hinge", body="arm")]},
        "sensor_pid 'pid': sensor component 'load.Fx' is a force of the constraint 'hinge', which is solved for .*"
        "a bushing with a bushing_load, a beam with a beam_load, or an elastic_rope with a rope_sensor, into the path",
    ),
    "a moment": (
        {"forces": [pid(sensor="moment"), ROPE],
         "sensors": [JointMoment(name="moment", joint="hinge", elements=("rope",))]},
        r"sensor component 'moment' is composed from the forces of other elements \(rope\), which only results",
    ),
    "the tension of a fixed rope": (
        {"forces": [pid(sensor="cell"), ROPE], "constraints": [FIXED],
         "sensors": [RopeSensor(name="cell", rope="fixed", components=("tension",))]},
        "sensor component 'cell' is a force of the constraint 'fixed', which is solved for together with the accel",
    ),
    "no such sensor of a block": (
        {"forces": [StateSpace(name="b", sensors=("x",), outputs=("pull",), D=((1.0,),)), ROPE]},
        "state_space 'b': sensor component 'x' does not exist",
    ),
}  # fmt: skip


@pytest.mark.parametrize("given, complaint", WRONG.values(), ids=WRONG)
def test_wrong_connections_are_refused(given, complaint):
    with pytest.raises(ModelError, match=complaint):
        Model(arm(**{"inputs": ["pull"], **given}))


def test_a_delayed_error_may_be_driven():
    """It reads the reference's value only."""
    forces = [pid(), DelayedError(name="late", joint="hinge", reference="pull", delay=0.1)]
    run = simulate(arm(forces=forces, inputs=["pull"]), 0.2, SolverOptions(rtol=1e-6)).check()
    assert np.isfinite(run.q).all()

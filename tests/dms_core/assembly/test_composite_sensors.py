"""Sensors composed from other elements' kernels: reaction of a constraint, equivalent moment of a group."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.derivatives.blocks import SensorBlocks
from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    Distance,
    Fixed,
    Gravity,
    Input,
    JointAngle,
    JointMoment,
    JointReaction,
    LumpedLoad,
    MuscleSensor,
    PointMass,
    Revolute,
    RigidBody,
    Steps,
    System,
)
from dms_core.model.geometry.frames import quaternion, rotation_matrix
from dms_core.simulation.dynamics import Simulation, SolverOptions, World, simulate
from tests.dms_core.assembly.specimen import FORCES, INPUTS, Point, random_point, scales, specimen
from tests.dms_core.test_derivatives import differences

REACTIONS = [
    ("shoulder", "upper", "ground"), ("shoulder", "upper", "upper"), ("elbow", "lower", "ground"),
    ("elbow", "lower", "upper"), ("elbow", "upper", "lower"), ("weld", "plate", "lower"), ("socket", "ball", "plate"),
    ("plane", "ball", "ball"), ("rod", "ball", "ball"), ("rod", "bob", "ground"), ("wire", "lower", "lower"),
    ("motor", "wheel", "wheel"), ("rail", "weight", "ground"), ("cord", "lower", "upper"), ("cord", "weight", "weight"),
    ("winch", "lift", "lift"), ("ball.euler_norm", "ball", "ground"),
]  # fmt: skip
GROUPS = {
    "muscle": ("biceps",), "ropes": ("pull", "cable"), "spring": ("spring",), "stop": ("stop",), "load": ("push",),
    "inertia": ("lower", "plate"), "all": ("biceps", "pull", "cable", "spring", "stop", "push", "gravity"),
}  # fmt: skip


def _sensors() -> list:
    reactions = [
        JointReaction(
            name=f"{c}.{b}.{f}", constraint=c, body=b, frame=f, point=(0.1, -0.2, 0.3) if f != "ground" else None
        )
        for c, b, f in REACTIONS
    ]
    moments = [
        JointMoment(name=f"{joint}.{name}", joint=joint, elements=elements, bodies=bodies)
        for name, elements in GROUPS.items()
        for joint, bodies in (("elbow", ("lower", "plate")), ("shoulder", ("upper", "lower", "plate", "ball", "bob")))
    ]
    return [*reactions, *moments, JointMoment(name="one", joint="elbow", elements=GROUPS["all"])]


@pytest.fixture(scope="module")
def model() -> Model:
    return specimen(*_sensors())


def _measured(model: Model, signals, x: Point) -> np.ndarray:
    """All sensors at one state, shape (n_y,)."""
    q, v, a, lam = (row[None] for row in x)
    return model.measure(signals, np.zeros(1), q, v, a, lam, np.zeros(1, bool))[0]


def _partials(model: Model, x: Point) -> SensorBlocks:
    world = World(model)
    return world.sensor_blocks(world.operating_point()._replace(q=x.q, v=x.v, a=x.a, lam=x.lam))


@pytest.mark.parametrize("seed", range(3))
def test_partials_are_differences_of_the_values(model, seed):
    signals, x, by = Simulation(model).state.signals, random_point(model, seed), scales(model)
    partials = _partials(model, x)
    for name, scale in (("q", by[0]), ("v", by[1]), ("a", by[1]), ("lam", np.ones(model.n_phi))):
        f = lambda z, name=name: _measured(model, signals, x._replace(**{name: z}))  # noqa: E731
        numeric, analytic = differences(f, getattr(x, name), scale), getattr(partials, name)
        value = np.abs(f(getattr(x, name)))[:, None]
        # Five points at 3e-5 of a scale: rounding 1e-16 / 3e-5 of the value; the tendon's fifth derivative needs 1e-6.
        allowed = 1e-6 * np.abs(numeric) + (1e-10 * value + 1e-8) / scale
        wrong = np.argwhere(np.abs(analytic - numeric) > allowed)
        assert not len(wrong), [(model.layout.outputs[i][0], j, analytic[i, j], numeric[i, j]) for i, j in wrong[:8]]
        assert np.any(numeric), f"no sensor depends on {name}: the test would pass with zeros"


def test_a_wrong_partial_is_found(model):
    signals, x = Simulation(model).state.signals, random_point(model, 0)
    numeric = differences(lambda q: _measured(model, signals, x._replace(q=q)), x.q, scales(model)[0])
    spoiled = _partials(model, x).q.copy()
    worst = np.unravel_index(np.argmax(np.abs(spoiled)), spoiled.shape)
    spoiled[worst] *= 1.0 + 1e-5
    assert np.abs(spoiled[worst] - numeric[worst]) > 1e-6 * np.abs(numeric[worst])


def test_partials_by_inputs(model):
    x, signals = random_point(model, 1), Simulation(model).state.signals
    partials, k = _partials(model, x), model.input_index("factor")
    before = _measured(model, signals, x)
    signals.c[signals.ptr[k], 0] += 1.0
    change = _measured(model, signals, x) - before
    assert np.any(change), "no sensor depends on the input: the test would pass with zeros"
    # Rope tension is linear in this input, so that a difference over 1 is exact but for rounding of values near 1e3.
    np.testing.assert_allclose(partials.u[:, k, 0], change, atol=1e-9)


def test_moment_of_a_muscle_is_its_force_times_its_moment_arm():
    """M = -sigma dl/dtheta (virtual work), dl/dtheta by turning the forearm in closed form."""
    facts = next(f for f in FORCES if f.name == "biceps")
    axis = np.array([0.1, -0.3, 1.0]) / math.sqrt(1.1)
    elbow = np.array([0.0, -0.4, 0.0])

    def muscle_length(theta: float) -> float:
        hand = elbow + rotation_matrix(quaternion(axis, theta)) @ np.array([0.05, -0.1, 0.02])
        points = [np.array([0.05, 0.1, 0.02]), np.array([0.04, -0.1, 0.0]), hand]
        return sum(np.linalg.norm(b - a) for a, b in zip(points, points[1:], strict=False))

    theta = 0.8
    system = System(
        "arm",
        bodies=[
            RigidBody(name="upper", mass=1.0, inertia=(0.1, 0.1, 0.1)),
            RigidBody(
                name="lower",
                mass=1.0,
                inertia=(0.1, 0.1, 0.1),
                position=tuple(elbow),
                orientation=tuple(quaternion(axis, theta)),
            ),
        ],
        constraints=[
            Fixed(name="weld", body_j="upper"),
            Revolute(name="elbow", body_i="upper", body_j="lower", point_i=tuple(elbow), axis_i=tuple(axis)),
        ],
        forces=[facts],
        sensors=[
            JointMoment(name="moment", joint="elbow", elements=("biceps",)),
            MuscleSensor(name="muscle", muscle="biceps", components=("tendon_force",)),
        ],
        inputs=[i for i in INPUTS if i.name == "command"],
    )
    model = Model(system)
    start = Point(model.start.q, model.start.v, np.zeros(model.n_q), np.zeros(model.n_phi))
    y = _measured(model, Simulation(model).state.signals, start)
    h = 1e-5
    arm = (muscle_length(theta + h) - muscle_length(theta - h)) / (2 * h)
    assert abs(y[1]) > 1.0 and abs(arm) > 0.01
    # The central difference errs by h^2 / 6 of a third derivative near 0.05 m: 1e-12 m times about 10 N.
    np.testing.assert_allclose(y[0], -y[1] * arm, rtol=1e-8)


def _hanging(angle: float) -> System:
    """A rod of 1 m and 2 kg released at rest; the joint is at its upper end."""
    turn = quaternion((0, 0, 1), angle)
    return System(
        "pendulum",
        bodies=[
            RigidBody(
                name="rod",
                mass=2.0,
                inertia=(1 / 6, 0.01, 1 / 6),
                centre_of_mass=(0.0, -0.5, 0.0),
                orientation=tuple(turn),
            )
        ],
        constraints=[Revolute(name="hinge", body_j="rod")],
        forces=[Gravity(name="gravity", acceleration=(0.0, -9.81, 0.0))],
        sensors=[
            JointReaction(name="world", constraint="hinge", body="rod"),
            JointReaction(name="own", constraint="hinge", body="rod", frame="rod"),
            JointReaction(name="tip", constraint="hinge", body="rod", point=(0.0, -1.0, 0.0)),
            JointAngle(name="angle", joint="hinge"),
        ],
    )


def test_reaction_of_a_pendulum_at_rest_and_released():
    y = {k: v[0] for k, v in simulate(_hanging(0.0), 0.01).sensors().items()}
    np.testing.assert_allclose([y["world.Fx"], y["world.Fy"], y["world.Mz"]], [0.0, 2.0 * 9.81, 0.0], atol=1e-11)
    # Released from the horizontal: a quarter of the weight remains (thin rod), across the rod.
    y = {k: v[0] for k, v in simulate(_hanging(math.pi / 2), 0.01).sensors().items()}
    np.testing.assert_allclose([y["world.Fx"], y["world.Fy"]], [0.0, 2.0 * 9.81 / 4.0], atol=1e-11)
    np.testing.assert_allclose([y["own.Fx"], y["own.Fy"]], [2.0 * 9.81 / 4.0, 0.0], atol=1e-11)
    # The same force seen at the tip, 1 m to the right: moment -(1 m) x F.
    np.testing.assert_allclose(y["tip.Mz"], -2.0 * 9.81 / 4.0, atol=1e-11)


def test_reaction_of_a_pendulum_in_motion():
    """Along the rod (5/2) m g cos(theta), across it m g sin(theta) / 4, for a rod released at 90 degrees."""
    y = simulate(_hanging(math.pi / 2), 0.8, SolverOptions(rtol=1e-8)).sensors()
    theta = y["angle.angle"]
    assert theta.min() < -0.5
    # Multipliers err by 3e-4 of their size at rtol = 1e-5, and by the power 2/3 less at 1e-8: 1.5e-4 of 50 N.
    np.testing.assert_allclose(y["own.Fy"], 2.5 * 2.0 * 9.81 * np.cos(theta), atol=5e-4)
    np.testing.assert_allclose(y["own.Fx"], 2.0 * 9.81 * np.sin(theta) / 4.0, atol=5e-4)


def test_reaction_of_a_cantilever():
    """F = m g - P at the wall, M = (weight x distance) - (load x distance): statics, so exact."""
    load = (1.0, -2.0, 3.0)
    system = System(
        "beam",
        bodies=[
            RigidBody(
                name="beam",
                mass=3.0,
                inertia=(0.01, 0.2, 0.2),
                centre_of_mass=(0.4, 0.0, 0.0),
                position=(0.5, 0.2, 0.0),
                orientation=tuple(quaternion((0, 0, 1), 0.3)),
            )
        ],
        constraints=[Fixed(name="wall", body_j="beam", point_i=(0.5, 0.2, 0.0))],
        forces=[
            Gravity(name="gravity", acceleration=(0.0, -9.81, 0.0)),
            LumpedLoad(name="load", body="beam", point=(0.9, 0.0, 0.0), force=load, moment=(0.5, 0.0, -0.7)),
        ],
        sensors=[JointReaction(name="wall_force", constraint="wall", body="beam")],
    )
    y = simulate(system, 0.01).sensors()
    A = rotation_matrix(quaternion((0, 0, 1), 0.3))
    weight = np.array([0.0, -3.0 * 9.81, 0.0])
    force = -(weight + load)
    moment = -(np.cross(A @ [0.4, 0, 0], weight) + np.cross(A @ [0.9, 0, 0], load) + [0.5, 0.0, -0.7])
    got = np.array([y[f"wall_force.{c}"][-1] for c in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")])
    # Rounding of forces near 30 N through a solve of condition 1e3.
    np.testing.assert_allclose(got, [*force, *moment], atol=1e-9)


def test_action_equals_reaction_and_bodies_must_belong(model):
    x, signals = random_point(model, 2), Simulation(model).state.signals
    y = dict(zip([n for n, _ in model.layout.outputs], _measured(model, signals, x), strict=True))
    assert y["rod.bob.ground.Fx"] != 0.0
    both = specimen(
        JointReaction(name="i", constraint="elbow", body="upper"),
        JointReaction(name="j", constraint="elbow", body="lower"),
    )
    x = Point(both.start.q, both.start.v, x.a, x.lam)  # on the constraint, where both points are one
    y = _measured(both, signals, x).reshape(2, 6)
    # Sums of terms near 10 N.
    np.testing.assert_allclose(y[0], -y[1], atol=1e-12)
    with pytest.raises(ModelError, match="'wheel' is not joined by 'elbow'"):
        specimen(JointReaction(name="wrong", constraint="elbow", body="wheel"))


def test_input_jump_shows_in_the_reaction_before_and_behind():
    system = System(
        "bob",
        bodies=[PointMass(name="bob", mass=1.0, position=(0.0, -1.0, 0.0))],
        constraints=[Distance(name="rod", body_j="bob")],
        forces=[LumpedLoad(name="pull", body="bob", force=(0.0, -1.0, 0.0), input="size")],
        sensors=[JointReaction(name="rod_force", constraint="rod", body="bob")],
        inputs=[Input(name="size", signal=Steps(times=(0.0, 0.05), values=(3.0, 7.0)))],
    )
    trajectory = simulate(system, 0.1)
    y = trajectory.sensors()["rod_force.Fy"]
    k = int(np.flatnonzero(np.diff(trajectory.t) == 0.0)[0])
    assert trajectory.t[k] == 0.05
    np.testing.assert_allclose(y[[k, k + 1]], [3.0, 7.0], atol=1e-10)

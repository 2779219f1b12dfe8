"""A bushing against closed forms: six small oscillations, energy in large ones, invariance, its load, its mistakes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from dms_core.analyses import static_equilibrium
from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    Bushing,
    BushingCurves,
    BushingLoad,
    CoordinateSensor,
    ForceLoad,
    Gravity,
    Input,
    LoadCurve,
    LumpedLoad,
    PointMass,
    RigidBody,
    SensorPid,
    System,
)
from dms_core.model.geometry.frames import g_matrix, quaternion, quaternion_product, rotation_matrix
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.dms_core.model.poses import random_motion, start
from tests.example_elements import Example
from tests.example_elements.forces import cushion
from tests.example_elements.kernel_call import KernelCall, kernel_calls

TIGHT = SolverOptions(rtol=1e-7)
MASS, INERTIA = 2.0, (0.02, 0.03, 0.045)
STIFFNESS = (200.0, 300.0, 450.0, 2.0, 4.0, 7.0)


def block(**changes) -> RigidBody:
    return RigidBody(**{"name": "block", "mass": MASS, "inertia": INERTIA} | changes)


def held(body: RigidBody, *sensors, forces=(), **changes) -> Model:
    """The block on a bushing to the ground, at the origin of both, undeformed in the identity pose."""
    given = {"name": "cushion", "body_j": "block", "point_j": (0.0, 0.0, 0.0), "orientation_j": (1.0, 0.0, 0.0, 0.0)}
    given |= {"stiffness": STIFFNESS} | changes
    return Model(System("held", bodies=[body], forces=[Bushing(**given), *forces], sensors=list(sensors)))


@pytest.mark.parametrize("direction", range(6))
def test_frequency_of_an_oscillation_in_one_direction(direction):
    """w = sqrt(k / m) along each axis and sqrt(k / J) about it, at any size; no other direction is stirred."""
    axis, size = np.eye(3)[direction % 3], 0.1
    sliding = direction < 3
    inertia = MASS if sliding else INERTIA[direction - 3]
    frequency = np.sqrt(STIFFNESS[direction] / inertia)
    place = {"position": tuple(size * axis)} if sliding else {"orientation": tuple(quaternion(axis, size))}
    found = simulate(held(block(**place)), 3.0 * 2.0 * np.pi / frequency, TIGHT).check()
    along = found.q[:, :3] if sliding else 2.0 * np.arcsin(found.q[:, 4:7])
    np.testing.assert_allclose(along @ axis, size * np.cos(frequency * found.t), atol=1e-3 * size)
    others = np.hstack([found.q[:, :3], found.q[:, 4:7]])
    others[:, direction] = 0.0
    assert np.abs(others).max() < 1e-9


def test_decay_of_a_damped_oscillation():
    """x = e^(-d t) cos(w t) + ..., d = c / 2 m: the envelope of a critically chosen quarter damping."""
    damping = 0.25 * 2.0 * np.sqrt(STIFFNESS[1] * MASS)
    found = simulate(
        held(block(position=(0.0, 1e-2, 0.0)), damping=(0.0, damping, 0.0, 0.0, 0.0, 0.0)), 1.0, TIGHT
    ).check()
    decay = damping / (2.0 * MASS)
    w = np.sqrt(STIFFNESS[1] / MASS - decay**2)
    expected = 1e-2 * np.exp(-decay * found.t) * (np.cos(w * found.t) + decay / w * np.sin(w * found.t))
    np.testing.assert_allclose(found.q[:, 1], expected, atol=1e-6)


def _kinetic(q: np.ndarray, v: np.ndarray) -> float:
    """Of the block [J]; omega in body axes from the Euler parameters, written out anew."""
    p, r = q[3:], v[3:]
    omega = 2.0 * np.array([
        -p[1] * r[0] + p[0] * r[1] + p[3] * r[2] - p[2] * r[3],
        -p[2] * r[0] - p[3] * r[1] + p[0] * r[2] + p[1] * r[3],
        -p[3] * r[0] + p[2] * r[1] - p[1] * r[2] + p[0] * r[3],
    ])  # fmt: skip
    return 0.5 * (MASS * v[:3] @ v[:3] + omega @ (np.array(INERTIA) * omega))


def test_energy_of_large_rotations_without_damping():
    """Tumbling by up to 2.5 rad about all axes at once, with one curve: the sum of both energies stays."""
    curve = LoadCurve(deflections=(-3.0, -1.0, 0.0, 1.0, 3.0), loads=(-20.0, -3.0, 0.0, 3.0, 20.0))
    body = block(velocity=(0.5, -1.0, 0.8), angular_velocity=(16.0, 12.0, -14.0))
    model = held(body, stiffness=(*STIFFNESS[:4], 0.0, STIFFNESS[5]), curves=BushingCurves(turn_y=curve))
    found = simulate(model, 3.0, SolverOptions(rtol=1e-8)).check()
    stored = PchipInterpolator(curve.deflections, curve.loads).antiderivative()
    energies, largest = [], 0.0
    for q, v in zip(found.q, found.v, strict=True):
        phi = Rotation.from_quat(q[[4, 5, 6, 3]]).as_rotvec()
        largest = max(largest, float(np.linalg.norm(phi)))
        spring = 0.5 * np.dot(STIFFNESS[:3], q[:3] ** 2) + 0.5 * (2.0 * phi[0] ** 2 + 7.0 * phi[2] ** 2)
        energies.append(_kinetic(q, v) + spring + float(stored(phi[1]) - stored(0.0)))
    assert 2.0 < largest < np.pi
    # A method of order 2 at rtol 1e-8 errs by some rtol^(2/3) = 5e-6 of what oscillates.
    np.testing.assert_allclose(energies, energies[0], rtol=2e-5)


def test_damping_takes_energy_only():
    """The work of the dampers is negative in any motion: r . v of a bushing without stiffness."""
    damper = Bushing(
        name="cushion",
        body_i="upper",
        body_j="lower",
        orientation_i=(0.9, 0.3, -0.2, 0.1),
        damping=(3, 2, 4, 0.2, 1, 3),
    )
    call = kernel_calls(Example(cushion().system, damper))[0]
    rng = np.random.default_rng(2)
    for seed in range(20):
        x = call.random_point(2 * seed)
        x.v[:] = random_motion(x.q, rng)
        assert call(x, 0)[0] @ x.v > 0.0


def _moved(x: np.ndarray, turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Both bodies after a rigid motion of the whole."""
    moved = x.copy()
    for o in (0, 7):
        moved[o : o + 3] = shift + rotation_matrix(turn) @ x[o : o + 3]
        moved[o + 3 : o + 7] = quaternion_product(turn, x[o + 3 : o + 7])
    return moved


def _cushion_call() -> KernelCall:
    return kernel_calls(cushion())[0]


@pytest.mark.parametrize("seed", range(0, 8, 2))
def test_a_rigid_motion_of_both_bodies_changes_nothing(seed):
    """The loads turn with the bodies; and a common motion does no work."""
    call, rng = _cushion_call(), np.random.default_rng(seed)
    x = call.random_point(seed)
    x.v[:] = 0.0
    turn = quaternion(rng.normal(size=3), rng.uniform(-3.0, 3.0))
    loads = call(x, 0)[0]
    after = call(x._replace(q=_moved(x.q, turn, rng.normal(size=3))), 0)[0]
    for o in (0, 7):
        np.testing.assert_allclose(after[o : o + 3], rotation_matrix(turn) @ loads[o : o + 3], atol=1e-10)
        # Generalised forces of Euler parameters turn as these do: Q_p is linear in p.
        np.testing.assert_allclose(after[o + 3 : o + 7], quaternion_product(turn, loads[o + 3 : o + 7]), atol=1e-10)
    common = np.concatenate([_together(x.q[o : o + 7], rng_state) for o, rng_state in ((0, 5), (7, 5))])
    assert abs(loads @ common) < 1e-10


def _together(q: np.ndarray, seed: int) -> np.ndarray:
    """Rates of one body in a motion of the whole that the seed tells."""
    rng = np.random.default_rng(seed)
    velocity, omega = rng.normal(size=3), rng.normal(size=3)
    e = np.concatenate([[0.0], omega])
    return np.concatenate([velocity + np.cross(omega, q[:3]), 0.5 * quaternion_product(e, q[3:])])


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.22, 0.23, 1.5, 3.1])
def test_the_rotation_is_that_of_its_vector_on_both_sides_of_the_series(angle):
    """Turned by an angle about an axis along which the stiffness is the same as about all: M = k angle."""
    axis = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
    body = block(orientation=tuple(quaternion(axis, angle)))
    sensor = ForceLoad(name="load", force="cushion", body="block")
    y = simulate(held(body, sensor, stiffness=(1.0, 1.0, 1.0, 3.0, 3.0, 3.0)), 1e-3).sensors()
    got = [y[f"load.M{x}"][0] for x in "xyz"]
    np.testing.assert_allclose(got, -3.0 * angle * axis, rtol=1e-10, atol=1e-15)


def test_a_rotation_is_taken_the_short_way_round():
    body = block(orientation=tuple(quaternion((0.0, 0.0, 1.0), np.pi + 0.1)))
    y = simulate(held(body, ForceLoad(name="load", force="cushion", body="block")), 1e-4).sensors()
    assert y["load.Mz"][0] == pytest.approx(7.0 * (np.pi - 0.1), rel=1e-9)


def test_a_block_hangs_where_its_weight_is_held():
    """Statics: x = m g / k, and the load on the block is its weight, in ground axes and in those of the block."""
    frame = quaternion((0.0, 0.0, 1.0), 0.5)
    y = simulate(
        held(
            block(orientation=tuple(frame), position=(0.0, -MASS * 9.81 / 300.0, 0.0)),
            ForceLoad(name="load", force="cushion", body="block"),
            ForceLoad(name="own", force="cushion", body="block", frame="block"),
            CoordinateSensor(name="height", coordinate="block.y"),
            forces=[Gravity(name="weight", acceleration=(0.0, -9.81, 0.0))],
            orientation_j=tuple(quaternion((0.0, 0.0, 1.0), -0.5)),
        ),
        0.5,
    ).sensors()
    np.testing.assert_allclose(y["height.value"], -MASS * 9.81 / 300.0, atol=1e-10)
    np.testing.assert_allclose(y["load.Fy"], MASS * 9.81, rtol=1e-8)
    np.testing.assert_allclose(y["load.Fx"], 0.0, atol=1e-8)
    np.testing.assert_allclose(y["own.Fx"], MASS * 9.81 * np.sin(0.5), rtol=1e-8)
    np.testing.assert_allclose(y["own.Fy"], MASS * 9.81 * np.cos(0.5), rtol=1e-8)


def test_load_on_both_bodies_is_equal_and_opposite():
    """Force, and moment about one point in space."""
    call = _cushion_call()
    x = call.random_point(4)
    r = call(x, 0)[0]
    np.testing.assert_allclose(r[:3], -r[7:10], atol=1e-12)
    moment = np.zeros(3)
    for o in (0, 7):
        p, Q = x.q[o + 3 : o + 7], r[o + 3 : o + 7]
        own = 0.5 * (-Q[0] * p[1:] + p[0] * Q[1:] + np.cross(p[1:], Q[1:]))
        moment += own + np.cross(x.q[o : o + 3], r[o : o + 3])
    np.testing.assert_allclose(moment, 0.0, atol=1e-11)


def test_what_is_not_given_is_undeformed_at_the_start():
    given = Bushing(name="cushion", body_i="upper", body_j="lower", stiffness=STIFFNESS)
    call = kernel_calls(Example(cushion().system, given))[0]
    np.testing.assert_allclose(call(start(call), 0)[0], 0.0, atol=1e-12)


def test_its_sensor_tells_what_it_does():
    """Forces in the axes of its frame, which are the ground's: those of a force_load, the other way; and the law."""
    damping = (3.0, 2.0, 4.0, 0.2, 0.1, 0.3)
    body = block(
        position=(0.03, -0.02, 0.05), velocity=(0.4, 0.1, -0.2), orientation=tuple(quaternion((0.3, 0.2, 0.9), 0.4)),
        angular_velocity=(0.5, -1.0, 2.0),
    )  # fmt: skip
    sensors = BushingLoad(name="gauge", bushing="cushion"), ForceLoad(name="load", force="cushion", body="block")
    run = simulate(held(body, *sensors, damping=damping), 0.3, SolverOptions(rtol=1e-6)).check()
    y = run.sensors(run.t)
    for k, axis in enumerate("xyz"):
        law = STIFFNESS[k] * run.q[:, k] + damping[k] * run.v[:, k]
        np.testing.assert_allclose(y[f"gauge.F{axis}"], law, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(y[f"load.F{axis}"], -y[f"gauge.F{axis}"], rtol=1e-12, atol=1e-12)
    # The rotation vector, and its rate by differences of the attitude a step on.
    turn = Rotation.from_quat(run.q[:, [4, 5, 6, 3]])
    w = 2.0 * np.array([g_matrix(p) @ pd for p, pd in zip(run.q[:, 3:], run.v[:, 3:], strict=True)])
    h = 1e-6
    far, near = ((turn * Rotation.from_rotvec(sign * h * w)).as_rotvec() for sign in (1.0, -1.0))
    for k, axis in enumerate("xyz"):
        law = STIFFNESS[3 + k] * turn.as_rotvec()[:, k] + damping[3 + k] * (far - near)[:, k] / (2.0 * h)
        np.testing.assert_allclose(y[f"gauge.M{axis}"], law, atol=1e-8)


def test_a_controller_holds_its_load():
    """The force of a bushing is led to its set-point by a force on the block: m sdd = F - T, T = k s + c sd."""
    m, k, c, kp, ki, wanted = MASS, 300.0, 12.0, 1.5, 30.0, 25.0
    loop = SensorPid(name="loop", sensor="gauge.Fy", output="force", kp=kp, ki=ki, setpoint=wanted)
    pull = LumpedLoad(name="pull", body="block", force=(0.0, 1.0, 0.0), input="force")
    cushion_to_block = Bushing(
        name="cushion",
        body_j="block",
        point_j=(0.0, 0.0, 0.0),
        stiffness=STIFFNESS,
        damping=(9.0, c, 9.0, 1.0, 1.0, 1.0),
    )
    system = System(
        bodies=[block()], forces=[cushion_to_block, pull, loop], inputs=[Input(name="force")],
        sensors=[BushingLoad(name="gauge", bushing="cushion")],
    )  # fmt: skip
    run = simulate(system, 1.5, SolverOptions(rtol=1e-8)).check()
    T = np.array([0.0, k, c])
    A = np.array([-ki * T, [0.0, 0.0, 1.0], (np.array([1.0, 0.0, 0.0]) - (1.0 + kp) * T) / m])
    rest = np.linalg.solve(-A, [ki * wanted, 0.0, kp * wanted / m])
    t = np.linspace(0.0, 1.5, 61)
    exact = np.array([T @ (rest - expm(A * x) @ rest) for x in t])
    assert np.abs(run.sensors(t)["gauge.Fy"] - exact).max() < 1e-3
    assert static_equilibrium(system).states().sensors()["gauge.Fy"][-1] == pytest.approx(wanted, rel=1e-10)


CURVE = LoadCurve(deflections=(-1.0, 0.0, 1.0), loads=(-1.0, 0.0, 2.0))
MISTAKES = {
    "negative": (
        {"stiffness": (1.0, 1.0, -5.0, 1.0, 1.0, 1.0)},
        "stiffness = .*component 2 is -5: expected",
    ),
    "negative damping": ({"damping": (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0)}, "damping = .*component 0 is -1"),
    "five": ({"stiffness": (1.0, 1.0, 1.0, 1.0, 1.0)}, "stiffness = .*Expected 6 items, got 5"),
    "both": (
        {"stiffness": (1.0,) * 6, "curves": BushingCurves(turn_x=CURVE)},
        "'turn_x' has the stiffness 1 and",
    ),
    "nothing": ({}, "stiffness and damping are 0 and there is no curve"),
    "no orientation": ({"stiffness": (1.0,) * 6, "orientation_i": (0.0, 0.0, 0.0, 0.0)}, "orientation_i.*length 0"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_wrong_bushing_is_refused(mistake):
    changes, message = MISTAKES[mistake]
    with pytest.raises(ModelError, match=f"bushing 'cushion': .*{message}"):
        Bushing(name="cushion", body_j="block", **changes)


def test_one_body_twice():
    with pytest.raises(ModelError, match="bushing 'cushion': Expected two different bodies, got 'block' twice"):
        held(block(), body_i="block")


def test_a_load_of_what_does_not_act_there():
    ball = PointMass(name="ball", mass=1.0)
    cushion_to_block = Bushing(name="cushion", body_j="block", stiffness=STIFFNESS)
    for key, message in (("body", "body = 'ball'"), ("frame", "frame = 'ball'")):
        sensor = ForceLoad(**{"name": "load", "force": "cushion", "body": "block"} | {key: "ball"})
        with pytest.raises(ModelError, match=f"force_load 'load': 'cushion' does not act on {message}. It acts on"):
            Model(System(bodies=[block(), ball], forces=[cushion_to_block], sensors=[sensor]))

"""Residual blocks and sensors at any operating point, against differences of their own values."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from numba import njit

from dms_core.assembly.derivatives.blocks import OperatingPoint
from dms_core.errors import InputError
from dms_core.model import (
    AngleDriver,
    Constant,
    Harmonic,
    Input,
    JointAngle,
    JointMoment,
    JointReaction,
    MuscleSensor,
    PointMass,
    Revolute,
    RigidBody,
    RopeForce,
    System,
    Tracking,
)
from dms_core.model.element import Force, Placement
from dms_core.model.forces import LumpedLoad
from dms_core.simulation.dynamics import World
from tests.dms_core.assembly.specimen import constraint_rows, random_point, scales, specimen
from tests.dms_core.test_derivatives import differences

SENSORS = (
    JointAngle(name="angle", joint="elbow"),
    JointReaction(name="reaction", constraint="elbow", body="lower"),
    JointMoment(
        name="moment", joint="shoulder", elements=("biceps", "pull", "blow"), bodies=("upper", "lower", "plate")
    ),
    MuscleSensor(name="muscle", muscle="biceps", components=("tendon_force", "activation")),
    Tracking(name="tracking", pid="pid"),
)


@pytest.fixture(scope="module")
def world() -> World:
    return World(specimen(*SENSORS))


def _point(world: World, seed: int) -> OperatingPoint:
    """A random point off the constraints, with mu of its own; inputs keep their values and get rates."""
    x, rng = random_point(world.model, seed), np.random.default_rng(seed)
    u = world.operating_point().u + np.array([0.0, 1.0, 1.0]) * rng.uniform(-1.0, 1.0, (6, 3))
    qdot, mu = x.v + rng.normal(size=len(x.v)), rng.uniform(-1.0, 1.0, len(x.lam))
    return OperatingPoint(x.q, qdot, x.v, x.a, x.lam, mu, u)


def _by_input(value: np.ndarray) -> np.ndarray:
    return value.reshape(len(value), -1)


def _table(world: World, at: OperatingPoint) -> dict[tuple[str, str], np.ndarray]:
    """Every derivative, row by column, as the docstring of blocks.py lists them; 0 where nothing stands."""
    b, y = world.blocks(at), world.sensor_blocks(at)
    n, G = len(at.q), b.phi_q.toarray()
    return {
        ("r1", "q"): b.r1_q.toarray(), ("r1", "qdot"): -np.eye(n), ("r1", "v"): np.eye(n), ("r1", "mu"): -G.T,
        ("r2", "q"): b.r2_q.toarray(), ("r2", "v"): b.r2_v.toarray(), ("r2", "a"): b.r2_a.toarray(),
        ("r2", "lam"): G.T, ("r2", "u"): _by_input(b.r2_u),
        ("r3", "q"): G, ("r3", "u"): _by_input(b.r3_u),
        ("r4", "q"): b.r4_q.toarray(), ("r4", "v"): G, ("r4", "u"): _by_input(b.r4_u),
        ("y", "q"): y.q, ("y", "v"): y.v, ("y", "a"): y.a, ("y", "lam"): y.lam, ("y", "mu"): y.mu,
        ("y", "u"): _by_input(y.u),
    }  # fmt: skip


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("column", OperatingPoint._fields)
def test_blocks_are_differences_of_the_values(world, column, seed):
    at = _point(world, seed)
    table, by = _table(world, at), dict(zip(("q", "v"), scales(world.model), strict=True))
    scale = {"qdot": by["v"], "a": by["v"], **by}.get(column, np.ones(getattr(at, column).size))
    shape = getattr(at, column).shape

    def values(x: np.ndarray) -> np.ndarray:
        there = at._replace(**{column: x.reshape(shape)})
        b = world.blocks(there)
        return np.concatenate([b.r1, b.r2, b.r3, b.r4, world.sensor_blocks(there).y])

    x = getattr(at, column).ravel()
    numeric, value = differences(values, x, scale), np.abs(values(x))[:, None]
    b = world.blocks(at)
    rows = {"r1": len(b.r1), "r2": len(b.r2), "r3": len(b.r3), "r4": len(b.r4), "y": len(value)}
    analytic = np.concatenate([table.get((row, column), np.zeros((k, len(x)))) for row, k in rows.items()][:4])
    analytic = np.concatenate([analytic, table.get(("y", column), np.zeros((len(value) - len(analytic), len(x))))])
    # As in test_newton_matrix: the curvature of the tendon, and rounding 1e-16 / 3e-5 of values whose terms are larger.
    size = np.maximum(value, np.abs(analytic) @ scale[:, None])
    allowed = 1e-6 * np.abs(numeric).max(axis=1, keepdims=True) + (1e-10 * size + 1e-9) / scale
    wrong = np.argwhere(np.abs(analytic - numeric) > allowed)
    assert not len(wrong), [(i, j, analytic[i, j], numeric[i, j]) for i, j in wrong[:8]]


def test_a_step_that_was_taken_leaves_no_residual():
    """An independent look at the values: what BDF2 has solved satisfies all four equations, welds included."""
    world = World(specimen(*SENSORS))
    world.advance(0.03)
    b = world.blocks()
    # Newton's method is left at a share of the tolerance 1e-5; forces are near 1e3. Constraints are closed to 1e-10, at
    # the small steps of a start their rates to 1e-13 c0, which is 1e-9 at most here.
    assert np.abs(b.r1).max() < 1e-5
    assert np.abs(b.r2).max() < 1e-2
    assert np.abs(b.r3).max() < 1e-10
    assert np.abs(b.r4).max() < 1e-9
    np.testing.assert_array_equal(world.sensor_blocks().y, world.read())


def test_inputs_are_those_that_were_set(world):
    before = world.operating_point().u
    k = world.model.input_index("factor")
    world.set_input("factor", 4.5)
    assert world.operating_point().u[k].tolist() == [4.5, 0.0, 0.0]
    r2 = world.blocks().r2
    world.set_input("factor", before[k, 0])
    assert np.any(r2 != world.blocks().r2)


def test_a_point_that_does_not_fit_is_refused(world):
    at = world.operating_point()
    with pytest.raises(InputError, match=r"expected v of shape \(143,\), got \(3,\)"):
        world.blocks(at._replace(v=np.zeros(3)))
    u = at.u.copy()
    u[2, 1] = np.nan
    with pytest.raises(InputError, match=r"expected finite numbers, got u\[2, 1\] = nan"):
        world.sensor_blocks(at._replace(u=u))


def test_a_driver_that_is_no_linear_function_of_its_input():
    """phi = angle - u^2 / 2: r4 by the value of u is -udot, which linear drivers never show."""

    @njit
    def driver(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
        phi[0] = q[0] - 0.5 * u[0, 0] ** 2 - 2.0 * u[1, 0]
        phi_t[0, 0] = -u[0, 0] * u[0, 1] - 2.0 * u[1, 1]
        phi_t[0, 1] = -(u[0, 1] ** 2) - u[0, 0] * u[0, 2] - 2.0 * u[1, 2]
        G[0, 0] = 1.0

    from dms_core.model.element import Constraint

    class Squared(Constraint):
        kind: ClassVar[str] = "squared"
        kernel: ClassVar = driver

        def rows(self):
            return ("x",)

        def place(self, system):
            return Placement(bodies=("m",), inputs=("a", "b"))

    system = System(
        bodies=[PointMass(name="m", mass=1.0)], constraints=[Squared(name="drive")],
        inputs=[Input(name="a", signal=Harmonic(amplitude=0.3, frequency=1.0)), Input(name="b")],
    )  # fmt: skip
    world = World(system)
    b = world.blocks(world.operating_point()._replace(u=np.array([[0.4, 3.0, 5.0], [1.0, -2.0, 0.0]])))
    np.testing.assert_allclose(b.r3_u[0], [[-0.4, 0.0, 0.0], [-2.0, 0.0, 0.0]], atol=1e-15)
    np.testing.assert_allclose(b.r4_u[0], [[-3.0, -0.4, 0.0], [0.0, -2.0, 0.0]], atol=1e-14)


@njit
def _own(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    r[0] -= par[0] * np.sin(u[0, 0]) * q[1] + u[0, 1] ** 2
    if level > 0:
        Jq[0, 1] -= par[0] * np.sin(u[0, 0])


class _Own(Force):
    """A kernel of the form that knows no derivatives by inputs."""

    kind: ClassVar[str] = "own_push"
    kernel: ClassVar = _own
    gain: float = 2.0

    def place(self, system):
        return Placement(bodies=("rod",), inputs=("wish",), numbers=(self.gain,))


class _Replaced(RopeForce):
    """A kernel of its own beside an inherited input_kernel, which belongs to another."""

    kind: ClassVar[str] = "replaced_rope"
    kernel: ClassVar = _own


def test_a_kernel_without_derivatives_by_inputs_is_differenced_and_named():
    system = System(
        bodies=[RigidBody(name="rod", mass=2.0, inertia=(0.2, 0.1, 0.2), position=(0.3, 0.5, 0.0))],
        constraints=[Revolute(name="hinge", body_j="rod")],
        forces=[_Own(name="own"), LumpedLoad(name="load", body="rod", force=(0.0, 5.0, 0.0), input="wish")],
        sensors=[JointMoment(name="moment", joint="hinge", elements=("own", "load"))],
        inputs=[Input(name="wish", signal=Constant(value=0.7))],
    )  # fmt: skip
    world = World(system)
    at = world.operating_point()
    at.u[0, 1] = 1.5
    b, y = world.blocks(at), world.sensor_blocks(at)
    assert b.differenced == ("own",) == y.differenced
    # Central differences with a step of 6e-6: 1e-10 of terms near 1.
    np.testing.assert_allclose(b.r2_u[0, 0], [-2.0 * np.cos(0.7) * at.q[1], -3.0, 0.0], atol=1e-9)
    # The force (Fx, Fy) at the centre of mass, which lies at r from the hinge: moment x Fy - y Fx.
    by_u = at.q[0] * 5.0 - at.q[1] * 2.0 * np.cos(0.7) * at.q[1]
    np.testing.assert_allclose(y.u[0, 0], [by_u, -at.q[1] * 3.0, 0.0], atol=1e-9)


def test_an_inherited_input_kernel_does_not_count_for_a_kernel_of_ones_own():
    from dms_core.compiled.entries import derivative_kernel

    assert derivative_kernel(RopeForce, "input_kernel") is not None
    assert derivative_kernel(_Replaced, "input_kernel") is None


def test_a_driven_angle_by_its_input():
    system = System(
        bodies=[RigidBody(name="rod", mass=2.0, inertia=(0.2, 0.1, 0.2))],
        constraints=[Revolute(name="hinge", body_j="rod"), AngleDriver(name="drive", joint="hinge", input="angle")],
        inputs=[Input(name="angle", signal=Harmonic(amplitude=0.3, frequency=1.0))],
    )  # fmt: skip
    world = World(system)
    row = constraint_rows(world.model.layout, "drive").start
    b = world.blocks()
    assert b.r3_u[row, 0].tolist() == [-1.0, 0.0, 0.0]
    assert b.r4_u[row, 0].tolist() == [0.0, -1.0, 0.0]

"""The assembled system against differences of its own residual, and what assembly finds out about a mechanism."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.derivatives.blocks import OperatingPoint
from dms_core.assembly.model import Model
from dms_core.errors import AssemblyError, InputError, ModelError, ModelWarning
from dms_core.linear.rank import minimum_norms
from dms_core.model import Distance, Fixed, Gravity, PointMass, Revolute, RigidBody, Spherical, System
from dms_core.model.geometry.frames import quaternion
from dms_core.results import Result
from dms_core.simulation.dynamics import SolverOptions, World, simulate
from tests.dms_core.assembly.specimen import (
    BODIES,
    CONSTRAINTS,
    FORCES,
    constraint_rows,
    random_point,
    scales,
    specimen,
)
from tests.dms_core.linear.exact_norm import exact_norm
from tests.dms_core.test_derivatives import CONCRETE, differences

IN_A_SYSTEM_OF_DRIVES = {
    "cylinder_contact", "cylinder_pair_contact", "dc_motor", "elastic_rope", "sensor_pid", "sphere_contact",
    "sphere_cylinder_contact", "sphere_pair_contact", "state_space", "winch",
}  # fmt: skip
"""Kinds whose system, and whose Newton matrix, are those of test_connections.py."""
NOT_IN_A_SYSTEM_OF_RIGID_PARTS: set[str] = {"delayed_error", "impedance_controller"} | IN_A_SYSTEM_OF_DRIVES
"""Kinds that need companions of their own; their kernels stand in test_derivatives."""


@pytest.fixture(scope="module")
def model() -> Model:
    return specimen()


class Stage:
    """One stage of the method at a random state with mu = 0: residual, matrix, factors."""

    def __init__(self, model: Model, c0: float, seed: int) -> None:
        self.world, self.c0, self.x = World(model), c0, random_point(model, seed)
        # The stage's constants such that qdot = v and vdot = a, up to something.
        self.cq = self.x.v - c0 * self.x.q + np.random.default_rng(seed).normal(size=model.n_q)
        self.cv = self.x.a - c0 * self.x.v
        self.point = self._point(self.x.q, self.x.v, self.x.lam, np.zeros(model.n_phi))
        self.factors = self.world.newton_matrix(c0, self.point)
        n, k = len(self.factors.coordinates), len(self.factors.rows)
        self.by_row = np.repeat([1.0 / c0, 1.0 / c0**2, 1.0, 1.0 / c0], [n, n, k, k])
        self.by_unknown = np.repeat([1.0, c0, c0**2, c0], [n, n, k, k])

    def _point(self, q, v, lam, mu) -> OperatingPoint:
        u = self.world.operating_point().u
        return OperatingPoint(q, self.c0 * q + self.cq, v, self.c0 * v + self.cv, lam, mu, u)

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Scaled residual (r1 / c0, r2 / c0^2, r3, r4 / c0) at the point plus the scaled correction x."""
        at, factors = self.point, self.factors
        q, v, lam, mu = (z.copy() for z in (at.q, at.v, at.lam, at.mu))
        for whole, where, change in zip(
            (q, v, lam, mu), 2 * [factors.coordinates] + 2 * [factors.rows], factors.parts(self.by_unknown * x),
            strict=True,
        ):  # fmt: skip
            whole[where] += change
        blocks = self.world.blocks(self._point(q, v, lam, mu))
        return self.by_row * factors.equations(blocks.r1, blocks.r2, blocks.r3, blocks.r4)

    def matrix(self) -> np.ndarray:
        """Dense scaled Newton matrix from the blocks."""
        n, m = len(self.point.q), len(self.point.lam)
        kept = np.concatenate([
            self.factors.coordinates, n + self.factors.coordinates, 2 * n + self.factors.rows,
            2 * n + m + self.factors.rows,
        ])  # fmt: skip
        A = self.world.blocks(self.point).newton(self.c0).toarray()[np.ix_(kept, kept)]
        return self.by_row[:, None] * A * self.by_unknown


def _unknown_scales(model: Model, c0: float) -> np.ndarray:
    """Sizes of the scaled unknowns (dq, dv / c0, dlam / c0^2, dmu / c0) over which the residual is smooth."""
    by_q, by_v = scales(model)
    free, k = model.welds.free, len(model.welds.solved)
    return np.concatenate([by_q[free], by_v[free] / c0, np.full(k, 10.0 / c0**2), np.full(k, 1.0 / c0)])


def test_the_specimen_has_every_kind():
    kinds = {x.kind for x in (*BODIES, *CONSTRAINTS, *FORCES)} | {"euler_norm"}
    wanted = {kind for kind, cls in CONCRETE.items() if not hasattr(cls, "outputs")}
    assert wanted - kinds == NOT_IN_A_SYSTEM_OF_RIGID_PARTS


@pytest.mark.parametrize("c0", [3.0, 1.5e3])
@pytest.mark.parametrize("seed", range(2))
def test_newton_matrix_is_the_derivative_of_the_residual(model, c0, seed):
    """At c0 = 3 all blocks weigh alike, so that each one shows; at 1500 as in a run of a millisecond's steps."""
    stage = Stage(model, c0, seed)
    A, by = stage.matrix(), _unknown_scales(model, c0)
    numeric, value = (
        differences(stage.residual, np.zeros(len(A)), by),
        np.abs(stage.residual(np.zeros(len(A))))[:, None],
    )
    # As in test_derivatives: rounding 1e-16 / 3e-5 of the residual, and the tendon's curvature 1e-6 of a derivative.
    allowed = 1e-6 * np.abs(numeric).max(axis=0) + (1e-11 * value + 3e-11 * np.abs(A) @ by[:, None]) / by + 1e-12
    wrong = np.argwhere(np.abs(A - numeric) > allowed)
    names = [model.layout.names[k] for k in model.welds.free] * 2
    names += [model.layout.row_names[k] for k in model.welds.solved] * 2
    assert not len(wrong), [(names[i], names[j], A[i, j], numeric[i, j]) for i, j in wrong[:8]]


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("c0", [10.0, 1.5e3, 1e6])
def test_the_models_own_lu_solves_with_that_matrix(model, c0, transposed):
    """The scatter into the LU and the elimination order, chosen at another state and another c0."""
    stage = Stage(model, c0, 1)
    A, x = stage.matrix(), np.random.default_rng(2).normal(size=(stage.factors.size, 3))
    row, unknown = stage.by_row[:, None], stage.by_unknown[:, None]
    if transposed:
        b = A.T @ x
        found = stage.factors.solve_transposed(b / unknown) / row
        left = A.T @ found
    else:
        b = A @ x
        found = stage.factors.solve(b / row) / unknown
        left = A @ found
    # A backward stable solve leaves 1e-15 of |A| |x|; pivots down to 1e-6 of their row cost the rest.
    np.testing.assert_allclose(left, b, atol=1e-8)
    one = (stage.factors.solve_transposed if transposed else stage.factors.solve)(b[:, 0])
    several = (stage.factors.solve_transposed if transposed else stage.factors.solve)(b)
    np.testing.assert_array_equal(one, several[:, 0])


def test_right_hand_sides_and_coefficients_that_do_not_fit_are_refused(model):
    stage = Stage(model, 10.0, 0)
    with pytest.raises(InputError, match=r"Expected right-hand sides of shape \(\d+,\) .* got \(3,\)"):
        stage.factors.solve(np.zeros(3))
    with pytest.raises(InputError, match=r"Expected a positive leading coefficient c0 \[1/s\], got -1"):
        stage.world.newton_matrix(-1.0)


def test_rates_behind_a_jump_close_the_equations_of_accelerations(model):
    """r2 = 0 and phi_q vdot + (phi_q v)_q v + phi_tt = 0, at the start and where an input was set on the way."""
    world = World(model)
    for t in (0.0, 0.02, 0.05):
        assert world.advance(t) is Result.SUCCESS
        world.set_input("factor", 12.0 - 100.0 * t)
        assert world.settle() is Result.SUCCESS
        at = world.operating_point(behind=True)
        blocks = world.blocks(at)
        phi_tt = blocks.r3_u[:, :, 0] @ at.u[:, 2]
        # Forces are near 1e3 N, accelerations near 1e2.
        assert np.abs(blocks.r2).max() < 1e-8
        assert np.abs(blocks.phi_q @ at.a + blocks.r4_q @ at.v + phi_tt)[model.active_rows].max() < 1e-8


def test_start_satisfies_every_equation(model):
    """phi, phi_q v + phi_t, and with consistent rates r1 and r2 = 0, at the assembled start."""
    world = World(model)
    world.settle()
    blocks = world.blocks(world.operating_point(behind=True))
    assert np.abs(blocks.r3).max() < 1e-12
    assert np.abs(blocks.r4).max() < 1e-12
    assert not blocks.r1.any()
    # Forces are near 1e3 N.
    assert np.abs(blocks.r2).max() < 1e-9
    trajectory = simulate(model, 0.01, SolverOptions(rtol=1e-8))
    h = trajectory.t[1]
    # A second look that knows nothing of the rates' equations: what the first step does.
    second = model.second_order
    assert np.all(np.abs(trajectory.v[1] - trajectory.v[0] - h * trajectory.a[0])[second] < 1e-2 * h)


def _bar(name: str, length: float, at: tuple[float, float], angle: float) -> RigidBody:
    return RigidBody(
        name=name,
        mass=1.0,
        inertia=(0.001, 0.1, 0.1),
        centre_of_mass=(length / 2, 0.0, 0.0),
        position=(*at, 0.0),
        orientation=tuple(quaternion((0, 0, 1), angle)),
    )


def _square(coupler: float = 1.0, **first) -> System:
    """Crank, coupler and rocker of a parallelogram, all axes along z; the last joint closes the loop."""
    crank = _bar("crank", 1.0, (0.0, 0.0), math.pi / 2)
    return System(
        "square",
        bodies=[
            crank.model_copy(update=first),
            _bar("coupler", coupler, (0.0, 1.0), 0.0),
            _bar("rocker", 1.0, (1.0, 0.0), math.pi / 2),
        ],
        constraints=[
            Revolute(name="a", body_j="crank"),
            Revolute(name="b", body_i="crank", body_j="coupler", point_i=(1.0, 0.0, 0.0), point_j=(0.0, 0.0, 0.0)),
            Revolute(name="c", body_i="coupler", body_j="rocker", point_i=(coupler, 0.0, 0.0), point_j=(1.0, 0.0, 0.0)),
            Revolute(name="d", body_j="rocker", point_i=(1.0, 0.0, 0.0), point_j=(0.0, 0.0, 0.0)),
        ],
        forces=[Gravity(name="gravity", acceleration=(5.0, -8.0, 0.0))],
    )


def test_redundant_rows_of_a_planar_loop_are_named():
    model = Model(_square())
    assert model.degrees_of_freedom == 1
    assert len(model.redundant_rows) == 3
    # What is redundant is out of the plane: z of a point, tilts of an axis. Rows declared earlier are kept.
    assert all(row.split(".")[1] in ("z", "tilt_f", "tilt_g") for row in model.redundant_rows)
    assert not any(row.startswith("a.") for row in model.redundant_rows)


def test_a_loop_that_is_nearly_closed_is_closed():
    with pytest.warns(ModelWarning, match=r"moved the body 'rocker' by 0\.07"):
        model = Model(_square(coupler=1.2))
    assert np.abs(model.constraint_jacobian(model.start.q)[0]).max() < 1e-12
    assert 0.01 < model.start.moved < 0.5


def test_a_loop_that_cannot_close_is_named_with_its_gap():
    with pytest.raises(
        AssemblyError, match=r"'square' cannot be assembled: constraint '[bcd]\.\w+' stays open by 0\.\d+"
    ):
        Model(_square(coupler=4.0))


def test_inconsistent_velocities_are_named():
    with pytest.raises(AssemblyError, match=r"velocities are inconsistent: constraint '\w\.\w+' would open at"):
        Model(_square(angular_velocity=(0.0, 0.0, 2.0)))
    with pytest.raises(AssemblyError, match=r"'rod.length' would open at"):
        Model(
            System(
                bodies=[PointMass(name="bob", mass=1.0, position=(1.0, 0.0, 0.0), velocity=(0.5, 1.0, 0.0))],
                constraints=[Distance(name="rod", body_j="bob")],
            )
        )


def test_an_unknown_name_is_refused_with_the_right_ones():
    with pytest.raises(ModelError, match="'bobb' does not exist. Declared: bob, ground"):
        Model(
            System(
                bodies=[PointMass(name="bob", mass=1.0)], constraints=[Distance(name="rod", body_j="bobb", length=1.0)]
            )
        )


def test_multipliers_of_redundant_constraints_are_those_of_least_norm():
    """A table on four welds: each carries a quarter, and G^T lam is what holds the weight."""
    legs = [(1.0, 0.0, 1.0), (1.0, 0.0, -1.0), (-1.0, 0.0, 1.0), (-1.0, 0.0, -1.0)]
    system = System(
        "table",
        bodies=[RigidBody(name="top", mass=8.0, inertia=(1.0, 1.0, 1.0))],
        constraints=[Fixed(name=f"leg{k}", body_j="top", point_i=p) for k, p in enumerate(legs)],
        forces=[Gravity(name="gravity", acceleration=(0.0, -10.0, 0.0))],
    )
    model = Model(system)
    assert model.degrees_of_freedom == 0
    assert len(model.redundant_rows) == 18
    trajectory = simulate(model, 0.1)
    lam = trajectory.lam[-1]
    rows = [constraint_rows(model.layout, f"leg{k}") for k in range(4)]
    # phi is ground minus body, so that lam is the force on the top: a quarter of the weight, to rounding.
    np.testing.assert_allclose([lam[r][1] for r in rows], 4 * [20.0], atol=1e-10)
    G = model.constraint_jacobian(trajectory.q[-1])[2]
    shortest = np.linalg.lstsq(G.T, G.T @ lam, rcond=1e-10)[0]
    np.testing.assert_allclose(lam, shortest, atol=1e-10)


def test_multipliers_of_many_states_at_once_are_those_of_each():
    """Ranks and sizes of rows mixed; against the singular value decomposition of one matrix."""
    rng = np.random.default_rng(3)
    G = np.stack([rng.normal(size=(9, r)) @ rng.normal(size=(r, 7)) * 10.0**k for k, r in enumerate((7, 5, 3, 1))])
    lam = rng.normal(size=(4, 9))
    for k, best in enumerate(minimum_norms(G, lam)):
        np.testing.assert_allclose(best, exact_norm(G[k], lam[k]), atol=1e-10)


def test_redundant_rows_do_not_change_the_motion():
    """The same square with balls in place of the hinges that close it: full rank, one freedom, equal motion."""
    hinged, options = _square(), SolverOptions(rtol=1e-8)
    free = [c for c in hinged.constraints if c.kind == "revolute"][:2]
    balls = [
        Spherical(name="c", body_i="coupler", body_j="rocker", point_i=(1.0, 0.0, 0.0), point_j=(1.0, 0.0, 0.0)),
        Revolute(name="d", body_j="rocker", point_i=(1.0, 0.0, 0.0), point_j=(0.0, 0.0, 0.0)),
    ]
    model = Model(System("balls", bodies=hinged.bodies, constraints=[*free, *balls], forces=hinged.forces))
    assert len(model.redundant_rows) == 1
    one, other = (simulate(x, 0.5, options).at([0.25, 0.5]).q for x in (Model(hinged), model))
    assert np.abs(one[1] - one[0]).max() > 0.1
    # Both run to 1e-8 of the same motion.
    np.testing.assert_allclose(one, other, atol=1e-6)

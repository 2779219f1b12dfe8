"""Radau IIA: its numbers, order 5 at and between steps, jumps, kept matrices, the same bits again."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model, Result, Simulation, SolverOptions, System, Trajectory, World, simulate
from dms_core.model import Harmonic, Input, LineGuide, LumpedLoad, PathPoint, PointMass, RopeLength, Steps
from dms_core.simulation.methods.radau_constants import A_INVERSE, COMPLEX, ERROR, REAL, STAGES, T_INVERSE, A, C, T
from tests.dms_core.literature.chain import chain

T_END = 0.8
STEPS = (1e-2, 5e-3, 2.5e-3)
TIMES, VALUES = (0.0, 0.123, 0.3, 0.55), (0.0, 1.0, -0.5, 0.2)


def radau(rtol: float = 1e-6, **options) -> SolverOptions:
    return SolverOptions(rtol=rtol, method="radau5", **options)


def _rates(errors) -> np.ndarray:
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.fixture(scope="module")
def model() -> Model:
    """The double pendulum of test_order.py."""
    return Model(chain(2, spin=1.5))


@pytest.fixture(scope="module")
def exact(model) -> Trajectory:
    """Errors of some 1e-13: rtol = 1e-13 takes steps of 2 ms on average."""
    return simulate(model, T_END, radau(1e-13)).check()


@pytest.fixture(scope="module")
def halved(model) -> list[Trajectory]:
    # The tolerance is that of Newton's method alone.
    return [simulate(model, T_END, radau(1e-12, fixed_step=h)).check() for h in STEPS]


def test_the_method_is_the_one_of_order_five():
    """Quadrature exact to degree 4, stages to degree 3 (Hairer and Wanner 1996, IV.5), and its eigenvalues."""
    c = np.array(C)
    for k in range(1, 6):
        assert A[-1] @ c ** (k - 1) == pytest.approx(1.0 / k, abs=1e-15)
    for k in range(1, STAGES + 1):
        np.testing.assert_allclose(A @ c ** (k - 1), c**k / k, atol=1e-15)
    blocks = np.array([[REAL, 0.0, 0.0], [0.0, COMPLEX.real, -COMPLEX.imag], [0.0, COMPLEX.imag, COMPLEX.real]])
    np.testing.assert_allclose(np.array(T) @ blocks @ np.array(T_INVERSE), np.array(A_INVERSE), atol=1e-13)
    # W_2 + i W_3 turns the block into a product with COMPLEX.
    w = np.array([0.3, -0.7])
    assert complex(*(blocks[1:, 1:] @ w)) == pytest.approx(COMPLEX * complex(*w))


def test_the_embedded_formula_is_of_order_three():
    """gamma_0 h f(y_n) and the stages: exact for polynomials up to degree 3, with Z_i = c_i^k."""
    for k, slope in ((1, 1.0), (2, 0.0), (3, 0.0)):
        assert slope + np.dot(ERROR, np.array(C) ** k) == pytest.approx(0.0, abs=1e-14)
    assert abs(np.dot(ERROR, np.array(C) ** 4)) > 0.05


@pytest.mark.parametrize("what", ["q", "v", "a", "lam"])
def test_halving_the_step_divides_errors_by_32(exact, halved, what):
    errors = [float(np.abs(getattr(run, what)[-1] - getattr(exact, what)[-1]).max()) for run in halved[:2]]
    assert 4.8 < _rates(errors)[0] < 5.2, errors


@pytest.mark.parametrize("what", ["q", "v", "a", "lam"])
def test_values_between_steps_are_of_order_five(exact, halved, what):
    """The cubic of the other methods would be of order 3 here, and multipliers linear in a step of order 1."""
    times = np.linspace(0.1, T_END, 1501)[:-1] + 1.234e-4
    wanted = getattr(exact.at(times), what)
    errors = [float(np.abs(getattr(run.at(times), what) - wanted).max()) for run in halved]
    # The times fall on other places within the steps of each run; what counts is the fall over both halvings.
    assert 4.5 < np.mean(_rates(errors)) < 6.0, errors


def test_multipliers_of_the_last_stage_are_of_order_three(model, exact):
    """What the record does not show: those of the method itself (Hairer and Wanner 1996, VII.4)."""
    errors = []
    for h in STEPS:
        world = World(model, radau(1e-12, fixed_step=h))
        assert world.advance(T_END) is Result.SUCCESS
        rows = model.active_rows
        own = world.state.radau.values.past_lam[-1]
        errors.append(float(np.abs(own[rows] - exact._lam[-1][rows]).max()))
    # 2.6 and 2.8 are found.
    assert np.all((_rates(errors) > 2.5) & (_rates(errors) < 3.5)), errors


@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-7, 1e-9, 1e-11])
def test_error_goes_with_the_tolerance_and_constraints_hold(model, exact, rtol):
    run = simulate(model, T_END, radau(rtol)).check()
    error = np.abs(run.q[-1] - exact.q[-1]).max()
    # 0.03 rtol at 1e-3 to 4 rtol at 1e-11 are found: the error goes with rtol^(5/6).
    assert error < 10.0 * rtol
    assert run.stats.largest_phi < 1e-10
    assert run.stats.largest_phi_v <= 1e-10
    # Steps as rtol^(-1/6).
    assert run.stats.steps < 12.0 * rtol ** (-1.0 / 6.0) / 3.0 + 20


def _pulled() -> Model:
    """A load that jumps."""
    pull = LumpedLoad(name="pull", body="rod1", point=(0.5, 0.0, 0.0), force=(0.0, 30.0, 0.0), input="size")
    return Model(
        chain(2, spin=1.5, forces=(pull,), inputs=(Input(name="size", signal=Steps(times=TIMES, values=VALUES)),))
    )


@pytest.fixture(scope="module")
def pulled() -> Model:
    return _pulled()


def test_steps_land_on_jumps(pulled):
    run, other = simulate(pulled, T_END, radau(1e-9)).check(), simulate(pulled, T_END, SolverOptions(rtol=1e-9)).check()
    np.testing.assert_array_equal(run.t[:-1][np.diff(run.t) == 0.0], TIMES[1:])
    assert run.stats.restarts == len(TIMES)
    for name in ("q", "v", "a", "lam"):
        for side in (0, 1):
            mine, theirs = (getattr(r, name)[np.flatnonzero(np.diff(r.t) == 0.0) + side] for r in (run, other))
            # BDF2's error, 1e-6 of the largest value.
            np.testing.assert_allclose(mine, theirs, atol=1e-5 * np.abs(theirs).max(), err_msg=name)
    # Between steps, too, a jump belongs to the side before it.
    np.testing.assert_array_equal(run.at([0.3]).q[0], run.q[np.flatnonzero(run.t == 0.3)[0]])
    before, behind = np.flatnonzero(run.t == 0.3)
    between = run.at([0.3]).a[0]
    assert np.abs(between - run.a[before]).max() < 1e-6 < 1.0 < np.abs(between - run.a[behind]).max()


def test_order_five_across_jumps(pulled):
    exact = simulate(pulled, T_END, radau(1e-13)).check()
    # Steps that end on the jumps without a shorter one between.
    runs = [simulate(pulled, T_END, radau(1e-12, fixed_step=h)).check() for h in (1e-2, 5e-3)]
    for what in ("q", "v", "lam"):
        errors = [float(np.abs(getattr(run, what)[-1] - getattr(exact, what)[-1]).max()) for run in runs]
        assert _rates(errors)[0] > 4.5, (what, errors)


OMEGA = 7.0


def _driven() -> Model:
    """A ball on a rope that a harmonic pays out: 0.2 m sin(7 t) about 1 m, straight below the eye."""
    return Model(
        System(
            bodies=[PointMass(name="ball", mass=2.0, position=(0.0, -1.0, 0.0))],
            constraints=[
                RopeLength(
                    name="rope",
                    path=(PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="ball", point=(0.0, 0.0, 0.0))),
                    input="length",
                ),
                LineGuide(name="rail", body_j="ball", axis_i=(0.0, 1.0, 0.0)),
            ],
            inputs=[
                Input(name="length", signal=Harmonic(offset=1.0, amplitude=0.2, frequency=OMEGA / (2.0 * np.pi))),
            ],
        )
    )


@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_a_motion_that_constraints_alone_rule(rtol):
    """Nothing is integrated: steps are exact, inputs those of the very time, and short enough for what lies between."""
    run = simulate(_driven(), 2.0, radau(rtol)).check()
    for states, error in ((run.own_steps(), 1e-12), (run.at(np.linspace(0.0, 2.0, 501)), rtol)):
        way = -0.2 * np.sin(OMEGA * states.t)
        np.testing.assert_allclose(states.coordinate("ball.y"), -1.0 + way, atol=error)
        np.testing.assert_allclose(states.a[:, 1], -(OMEGA**2) * way, atol=OMEGA**2 * 100.0 * error)
        np.testing.assert_allclose(states.rate("ball.y"), -0.2 * OMEGA * np.cos(OMEGA * states.t), atol=100.0 * error)
    # h |phi_q^T mu| keeps them short; otherwise they were 0.1 s at every tolerance.
    assert run.stats.largest_step <= (0.1 if rtol > 1e-6 else 0.05)


def test_matrices_are_kept(model):
    """At a tight tolerance most steps are solved with matrices of a step before; a World records nothing."""
    world = World(model, radau(1e-11))
    assert world.advance(T_END) is Result.SUCCESS
    stats = world.stats()
    # 0.33 are found; four iterations a step.
    assert stats.factorisations < 0.5 * stats.steps
    assert stats.newton_iterations < 5.0 * stats.steps


def test_the_same_run_twice_gives_the_same_bits(pulled):
    one, other = (simulate(Model(pulled.system), T_END, radau()).check() for _ in range(2))
    for what in ("t", "q", "v", "a", "lam", "mu"):
        np.testing.assert_array_equal(getattr(one, what), getattr(other, what))
    assert one.stats == other.stats


def test_advance_in_pieces_is_the_same_run_to_tolerance(model, exact):
    simulation = Simulation(model, radau(1e-8))
    for t in np.linspace(0.1, T_END, 8):
        assert simulation.advance(t) is Result.SUCCESS
    assert np.abs(simulation.trajectory().q[-1] - exact.q[-1]).max() < 1e-7


def test_other_methods_pay_nothing(model):
    """No array, and no machine code, of a method that does not run."""
    state = World(model, SolverOptions()).state
    assert sum(x.size for x in state.radau.values) == state.radau.values.control.size
    assert np.count_nonzero(state.parts == 0) == 3
    assert np.count_nonzero(World(model, radau()).state.parts == 0) == 0


def test_a_step_that_is_too_long_ends_the_run(model):
    run = simulate(model, 5.0, radau(fixed_step=0.5))
    assert run.result is Result.NEWTON_FAILED
    assert all(np.isfinite(x).all() for x in (run.q, run.v, run.a, run.lam))

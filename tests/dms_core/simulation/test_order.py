"""Order of the method in positions, velocities, multipliers and between steps; energy, constraints, events, results.

The problem is the double pendulum of two rods, which starts with a spin so that nothing vanishes at the start.
"""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import DmsError, InputError, SimulationError
from dms_core.model import Constant, Input, LumpedLoad, Steps
from dms_core.results import Result, Trajectory
from dms_core.simulation.dynamics import Simulation, SolverOptions, simulate
from tests.dms_core.literature.chain import chain, energy, tip

T_END = 0.8
STEPS = (2e-3, 1e-3, 5e-4)
SPIN = 1.5


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(chain(2, spin=SPIN))


@pytest.fixture(scope="module")
def exact(model) -> Trajectory:
    """Errors some 1e-4 of those of the steps above: rtol = 1e-10 takes steps of 1e-5 to 1e-4 s."""
    return simulate(model, T_END, SolverOptions(rtol=1e-10)).check()


@pytest.fixture(scope="module")
def halved(model) -> list[Trajectory]:
    return [simulate(model, T_END, SolverOptions(fixed_step=h)).check() for h in STEPS]


def _rates(errors: list[float]) -> np.ndarray:
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.parametrize("what", ["q", "v", "a", "lam"])
def test_halving_the_step_divides_errors_by_four(exact, halved, what):
    errors = [float(np.abs(getattr(run, what)[-1] - getattr(exact, what)[-1]).max()) for run in halved]
    assert np.all((_rates(errors) > 1.9) & (_rates(errors) < 2.1)), errors


@pytest.mark.parametrize("what", ["q", "v", "a", "lam"])
def test_dense_output_is_of_order_two(exact, halved, what):
    """Largest error over times that fall between steps. vdot between steps is the slope of the cubic of v."""
    times = np.linspace(0.1, T_END, 501)[:-1] + 1.234e-4
    reference = exact.at(times)
    errors = [float(np.abs(getattr(run.at(times), what) - getattr(reference, what)).max()) for run in halved]
    # The times fall on other places within the steps of each run; what counts is the fall over both halvings.
    assert 1.85 < np.mean(_rates(errors)) < 2.15, errors


def test_multipliers_are_accurate_from_the_first_step(model, exact):
    """The start's last stage alone would give order one, 2e-2 N at a millisecond."""
    run = simulate(model, 0.01, SolverOptions(fixed_step=1e-3))
    error = np.abs(run.lam - exact.at(run.t).lam).max(axis=1)
    # Of order two from the second step on (2.5e-4 N), and that of the positions alone on the first.
    assert error[1] < 1e-5
    assert error.max() < 1e-3


def test_dense_output_meets_the_steps(halved):
    run = halved[0]
    states = run.at(run.t[3:])
    # Interpolation at its own nodes: rounding of values near 10.
    for what in ("q", "v", "lam"):
        np.testing.assert_allclose(getattr(states, what), getattr(run, what)[3:], atol=1e-11)
    with pytest.raises(DmsError, match="the run covers 0 ... 0.8 s"):
        run.at([0.1, 0.9])


def test_error_falls_with_the_tolerance(model, exact):
    """A local error of rtol in steps of rtol^(1/3): the global error goes as rtol^(2/3)."""
    errors, steps = [], []
    for rtol in (1e-4, 1e-5, 1e-6, 1e-7):
        run = simulate(model, T_END, SolverOptions(rtol=rtol))
        errors.append(float(np.abs(run.q[-1] - exact.q[-1]).max()))
        steps.append(run.stats.steps)
    exponents = np.log10(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(exponents > 0.4), errors
    assert 0.5 < np.mean(exponents) < 0.9, errors
    # The default tolerance, and the number of steps as rtol^(-1/3).
    assert errors[1] < 2e-3
    assert 1.8 < steps[3] / steps[2] < 2.5, steps


def test_energy_of_the_free_pendulum(model):
    """BDF2 damps a little: the loss at h is of order two, and small at a tight tolerance."""
    run = simulate(model, 3.0, SolverOptions(rtol=1e-8)).check()
    values = np.array([energy(q, v) for q, v in zip(run.q[::20], run.v[::20], strict=True)])
    assert np.ptp(run.q[:, 1]) > 0.5
    # 15 J swing to and fro; 1e-8 a step over some 20000 steps, in the mean with alternating sign.
    assert np.ptp(values) < 2e-4


def test_constraints_hold_over_a_minute(model):
    run = simulate(model, 60.0, SolverOptions(rtol=1e-4)).check()
    assert run.stats.largest_phi < 1e-9
    assert run.stats.largest_phi_v < 1e-9
    # What the statistics say is what the states say: at some steps and at the end.
    for k in (len(run.t) // 3, len(run.t) // 2, -1):
        phi, phi_v, _, _ = model.constraint_jacobian(run.q[k], run.v[k])
        assert np.abs(phi).max() <= run.stats.largest_phi
        assert np.abs(phi_v).max() <= run.stats.largest_phi_v * (1 + 1e-9) + 1e-15
    assert 0.0 < run.stats.largest_mu < 0.1


def test_mu_vanishes_with_the_step(halved):
    """mu = 0 on an exact solution: what is left is the error of the method, of order two."""
    errors = [float(np.abs(run.mu[-1]).max()) for run in halved]
    assert np.all(np.abs(_rates(errors) - 2.0) < 0.1), errors


@pytest.mark.parametrize("t_end", [0.01, 0.0105, 0.1, 1.0 / 3.0])
def test_fixed_steps_land_on_the_end(model, t_end):
    h = 1e-3
    run = simulate(model, t_end, SolverOptions(fixed_step=h)).check()
    assert run.t[-1] == t_end
    # All steps are h but for the last; times are sums, hence the rounding.
    np.testing.assert_allclose(np.diff(run.t)[:-1], h, rtol=1e-9)
    assert np.diff(run.t)[-1] <= h * (1 + 1e-9)


def test_fixed_steps_survive_odd_pieces(model, exact):
    """Calls of `advance` that cut steps short cost no order: the next step is many times longer than the last."""
    simulation = Simulation(model, SolverOptions(fixed_step=1e-3))
    for t in np.arange(0.01037, T_END, 0.01037):
        assert simulation.advance(t) is Result.SUCCESS
    simulation.advance(T_END)
    plain = simulate(model, T_END, SolverOptions(fixed_step=1e-3))
    wanted = exact.q[-1]
    error = np.abs(simulation.trajectory().q[-1] - wanted).max()
    assert error < 2.0 * np.abs(plain.q[-1] - wanted).max()


PULL = LumpedLoad(name="pull", body="rod1", point=(0.5, 0.0, 0.0), force=(0.0, 30.0, 0.0), input="size")
TIMES, VALUES = (0.0, 0.1234, 0.3, 0.55), (0.0, 1.0, -0.5, 0.2)


def _pulled(signal) -> Model:
    return Model(chain(2, forces=(PULL,), inputs=(Input(name="size", signal=signal),)))


@pytest.fixture(scope="module")
def stepped() -> Model:
    return _pulled(Steps(times=TIMES, values=VALUES))


@pytest.mark.parametrize("options", [SolverOptions(), SolverOptions(fixed_step=1e-3)])
def test_steps_land_on_jumps(stepped, options):
    run = simulate(stepped, T_END, options).check()
    np.testing.assert_array_equal(run.t[:-1][np.diff(run.t) == 0.0], TIMES[1:])
    assert run.stats.restarts == len(TIMES)
    for t in TIMES[1:]:
        before, behind = np.flatnonzero(run.t == t)
        # Positions and velocities go on, accelerations and multipliers jump.
        np.testing.assert_array_equal(run.q[before], run.q[behind])
        np.testing.assert_array_equal(run.v[before], run.v[behind])
        assert np.abs(run.a[behind] - run.a[before]).max() > 1.0
        assert np.abs(run.lam[behind] - run.lam[before]).max() > 1.0


def test_order_two_across_jumps(stepped):
    """The start behind each jump is of order two, too."""
    exact = simulate(stepped, T_END, SolverOptions(rtol=1e-10))
    runs = [simulate(stepped, T_END, SolverOptions(fixed_step=h)) for h in STEPS]
    for what in ("q", "v", "lam"):
        errors = [float(np.abs(getattr(run, what)[-1] - getattr(exact, what)[-1]).max()) for run in runs]
        assert np.all(_rates(errors) > 1.8), (what, errors)


def test_inputs_set_between_calls_equal_a_table(stepped):
    options = SolverOptions(rtol=1e-8)
    simulation = Simulation(_pulled(Constant(value=VALUES[0])), options)
    for t, value in zip(TIMES[1:], VALUES[1:], strict=True):
        simulation.advance(t)
        simulation.set_input("size", value)
    simulation.advance(T_END)
    one, other = simulation.trajectory(), simulate(stepped, T_END, options)
    # Both are runs of the same tolerance; they differ by which step sizes the first jump finds.
    np.testing.assert_allclose(one.q[-1], other.q[-1], atol=1e-7)
    np.testing.assert_array_equal(one.t[:-1][np.diff(one.t) == 0.0], TIMES[1:])
    with pytest.raises(InputError, match="declared as a function of time"):
        Simulation(stepped).set_input("size", 1.0)
    with pytest.raises(InputError, match="a finite number"):
        simulation.set_input("size", np.nan)


def test_advance_in_pieces_is_the_same_run_to_tolerance(model, exact):
    simulation = Simulation(model, SolverOptions(rtol=1e-6))
    for t in np.linspace(0.02, T_END, 40):
        assert simulation.advance(t) is Result.SUCCESS
        assert simulation.time == t
    whole = simulate(model, T_END, SolverOptions(rtol=1e-6))
    wanted = np.abs(whole.q[-1] - exact.q[-1]).max()
    assert np.abs(simulation.trajectory().q[-1] - exact.q[-1]).max() < 2.0 * wanted
    assert simulation.stats().steps < 1.3 * whole.stats.steps


@pytest.mark.parametrize(
    ("options", "result", "sentence"),
    [
        (SolverOptions(max_steps=50), Result.TOO_MANY_STEPS, "raise max_steps"),
        (SolverOptions(fixed_step=0.2), Result.NEWTON_FAILED, "smaller fixed step"),
    ],
)
def test_a_run_that_fails_gives_what_it_has(model, options, result, sentence):
    run = simulate(model, 5.0, options)
    assert run.result is result
    assert not run.success
    assert sentence in run.message
    assert f"Stopped at t = {run.t[-1]:.6g} s" in run.message
    assert 0.0 < run.t[-1] < 5.0
    assert len(run.t) == run.stats.steps + run.stats.restarts
    assert all(np.isfinite(x).all() for x in (run.q, run.v, run.a, run.lam, run.mu))
    assert np.isfinite(run.at([run.t[-1] / 2]).q).all()
    with pytest.raises(SimulationError, match="Stopped at t"):
        run.check()


def test_a_step_below_the_smallest_ends_the_run():
    """Two rods that whirl five times a second need steps of 1e-4 s at this tolerance."""
    options = SolverOptions(rtol=1e-6, h_min=2e-3)
    run = simulate(Model(chain(2, spin=30.0)), 1.0, options)
    assert run.result is Result.STEP_TOO_SMALL
    assert run.t[-1] < 1.0


def test_options_out_of_range_are_named():
    with pytest.raises(InputError, match="rtol: Expected a positive number, got -1"):
        SolverOptions(rtol=-1)
    with pytest.raises(InputError, match="fixed_step: Expected a positive number or None, got 0"):
        SolverOptions(fixed_step=0)


def test_the_same_run_twice_gives_the_same_bits(stepped):
    one, other = (simulate(Model(stepped.system), T_END) for _ in range(2))
    for what in ("t", "q", "v", "a", "lam", "mu"):
        np.testing.assert_array_equal(getattr(one, what), getattr(other, what))
    assert one.stats == other.stats
    assert np.abs(tip(one.q[-1]) - tip(simulate(stepped, T_END, SolverOptions(rtol=2e-5)).q[-1])).max() > 0.0

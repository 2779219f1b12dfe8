"""SDIRK2 throughout: order at landings, agreement with BDF2 where inputs jump, steps far from and near to landings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core import Model, Result, SolverOptions, Trajectory, World, simulate
from dms_core.assembly.residual import evaluate_inputs, evaluate_residual
from dms_core.compiled.arena import Packed
from dms_core.errors import InputError
from dms_core.model import Input, LumpedLoad, MinimumJerk, Steps
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from tests.dms_core.literature.chain import chain

T_END = 0.8
STEPS = (2e-3, 1e-3, 5e-4)
LANDINGS = np.linspace(0.1, T_END, 8)
PERIOD = 0.02
PULL = LumpedLoad(name="pull", body="rod1", point=(0.5, 0.0, 0.0), force=(0.0, 30.0, 0.0), input="size")


def one_step(rtol: float = 1e-5, **options) -> SolverOptions:
    return SolverOptions(rtol=rtol, method="sdirk2", **options)


def _rates(errors: list[float]) -> np.ndarray:
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.fixture(scope="module")
def model() -> Model:
    """The double pendulum of test_order.py."""
    return Model(chain(2, spin=1.5))


@pytest.fixture(scope="module")
def exact(model):
    """BDF2 in steps of 1e-5 to 1e-4 s: errors below 1e-3 of those of the steps above."""
    return simulate(model, T_END, SolverOptions(rtol=1e-10)).check()


def _landings(model: Model, h: float) -> dict[str, np.ndarray]:
    """States at the landings of a world that keeps no record, as those of the environment keep none."""
    # The tolerance is that of Newton's method alone, well below the errors of the steps.
    world, found = World(model, one_step(1e-8, fixed_step=h)), {"q": [], "v": [], "vd": [], "lam": []}
    for t in LANDINGS:
        assert world.advance(t) is Result.SUCCESS
        for name, values in found.items():
            values.append(getattr(world.state, name).copy())
    return {name: np.array(values) for name, values in found.items()}


def test_halving_the_step_divides_errors_at_landings_by_four(model, exact):
    runs, wanted = [_landings(model, h) for h in STEPS], exact.at(LANDINGS)
    for name, theirs in (("q", wanted.q), ("v", wanted.v), ("vd", wanted.a), ("lam", wanted.lam)):
        errors = [float(np.abs(run[name] - theirs).max()) for run in runs]
        assert np.all((_rates(errors) > 1.9) & (_rates(errors) < 2.1)), (name, errors)


def test_a_recorded_run_is_of_order_two_at_every_step(model, exact):
    runs = [simulate(model, T_END, one_step(1e-8, fixed_step=h)).check() for h in STEPS]
    for name in ("q", "v", "a", "lam"):
        errors = [float(np.abs(getattr(run, name) - getattr(exact.at(run.t), name)).max()) for run in runs]
        assert np.all((_rates(errors) > 1.9) & (_rates(errors) < 2.1)), (name, errors)


@pytest.mark.parametrize("rtol", [1e-4, 1e-5, 1e-6])
def test_error_stays_below_the_tolerance(model, exact, rtol):
    """Its estimate rests on accelerations of order 1, and is on the safe side: 4 to 8 percent of rtol are found."""
    run = simulate(model, T_END, one_step(rtol)).check()
    assert np.abs(run.q[-1] - exact.q[-1]).max() < 0.3 * rtol
    assert max(run.stats.largest_phi, run.stats.largest_phi_v) < 1e-8


def test_steps_grow_with_what_the_motion_allows(model):
    """Far from a landing the size follows the error: the careful first step says nothing about the rest."""
    stats = simulate(model, T_END, one_step(1e-4)).check().stats
    assert stats.largest_step > 5.0 * stats.smallest_step
    # 562 are found; 1834 of the first step's size would be needed.
    assert stats.steps < 700


def _jumping() -> Model:
    """A load that takes another random value every 20 ms."""
    times = tuple(np.arange(40) * PERIOD)
    values = tuple(np.random.default_rng(0).uniform(-1.0, 1.0, len(times)))
    size = Input(name="size", signal=Steps(times=times, values=values))
    return Model(chain(2, spin=1.5, forces=(PULL,), inputs=(size,)))


def test_inputs_that_jump_every_period():
    model = _jumping()
    one = simulate(model, T_END, one_step(1e-6)).check()
    other = simulate(model, T_END, SolverOptions(rtol=1e-10)).check()
    assert one.stats.restarts == other.stats.restarts == 40
    for name in ("q", "v", "a", "lam"):
        for side in (0, 1):
            mine, theirs = (getattr(r, name)[np.flatnonzero(np.diff(r.t) == 0.0) + side] for r in (one, other))
            assert mine.shape == theirs.shape and len(mine) == 39
            # 3e-8 of the largest value are found, in positions and in forces.
            np.testing.assert_allclose(mine, theirs, atol=2e-7 * np.abs(theirs).max(), err_msg=name)


def test_rates_behind_a_jump_solve_the_equations():
    """Found with the factors of the step before, also where an input scales a controller or drives muscles."""
    start, end = math.radians(40.0), math.radians(60.0)
    model = Model(
        Ecosystem().system(
            start,
            MinimumJerk(times=(0.0, 0.4), values=(start, end)),
            {m: Steps(times=(0.0, 0.1), values=(0.01, 0.3)) for m in Arm().muscles},
            device_inputs=[Input(name="assistance", signal=Steps(times=(0.0, 0.1, 0.15), values=(1.0, 0.3, 0.8)))],
        )
    )
    run = simulate(model, 0.2, one_step(1e-4)).check()
    jumps = np.flatnonzero(np.diff(run.t) == 0.0)
    assert len(jumps) == 2
    for before in jumps:
        behind = before + 1
        left, right = (_residual(model, run, k, behind) for k in (before, behind))
        # Without the correction: thousands of N in the motors' rows. With it: rounding of forces near 1e3 N.
        assert np.abs(left).max() > 1.0
        assert np.abs(right).max() < 1e-10
        _, _, G, W = model.constraint_jacobian(run.q[behind], run.v[behind])
        second = np.abs(G @ run.a[behind] + W @ run.v[behind]).max()
        assert second < 1e-9


def _residual(model: Model, run: Trajectory, k: int, inputs: int) -> np.ndarray:
    """Second block of eq. 2 at the recorded step k, with the inputs just behind the time of step `inputs`."""
    work = model.new_work()
    n = model.n_q
    work.q[:n], work.v[:n], work.a[:n], work.lam[:] = run.q[k], run.v[k], run.a[k], run.lam[k]
    packed = Packed(work)
    evaluate_inputs(Packed(run.signals).table, run.t[inputs], False, packed.table)
    evaluate_residual(model._dynamics.table, model._constraints.table, packed.table)
    return work.r2[:n]


def test_unknown_methods_are_named():
    with pytest.raises(InputError, match="method: Expected one of bdf2, radau5, sdirk2, got 'rk4'"):
        SolverOptions(method="rk4")  # type: ignore[arg-type]

"""Independent rows and orders of elimination are chosen anew where the old ones fail, and nobody sees it."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Simulation, SolverOptions, World, simulate
from dms_core.simulation.state import CLOCK, COUNTS
from tests.dms_core.cases import model
from tests.dms_core.mechanisms.study import energy

METHODS = ["bdf2", "sdirk2"]


@pytest.mark.parametrize("method", [*METHODS, "radau5"])
@pytest.mark.parametrize(("name", "t_end"), [("bennett", 1.0), ("bricard", 1.5)])
def test_rows_are_chosen_anew_in_time(name, t_end, method):
    """The rows of the start become dependent at 0.474 and 1.248 s; with them, both runs end there."""
    simulation = Simulation(model(name), SolverOptions(rtol=1e-6, method=method))
    simulation.advance(t_end)
    run = simulation.trajectory().check()
    assert not np.array_equal(simulation.tables.values.active, simulation.model.start.active)
    total, kinetic = energy(run)
    # The local error of 1e-7 adds up over thousands of steps; 3e-5 was seen.
    assert np.abs(total - total[0]).max() < 1e-4 * kinetic.max()
    assert run.stats.largest_phi < 1e-9


@pytest.mark.parametrize(("name", "t_end"), [("bennett", 1.0), ("bricard", 1.5)])
def test_pivots_of_radau_are_watched(name, t_end):
    """Before its iterations fail, not behind them: 0.8 and 0.6 failures a step without, 0.3 and 0.4 with a watch."""
    simulation = Simulation(model(name), SolverOptions(rtol=1e-6, method="radau5"))
    simulation.advance(t_end)
    stats = simulation.trajectory().check().stats
    assert stats.rejected_newton < 0.5 * stats.steps


@pytest.mark.parametrize("method", [*METHODS, "radau5"])
def test_a_singular_position_that_is_left_behind_is_forgotten(method):
    """Its pivot is a thousandth of that of the first matrix of the step."""
    simulation = Simulation(model("bennett"), SolverOptions(method=method))
    simulation.advance(0.1)
    clock = simulation.state.clock
    assert clock[CLOCK.best_pivot] >= clock[CLOCK.pivot] > 0.0
    clock[CLOCK.singular_pivot] = 1e-3 * clock[CLOCK.pivot]
    simulation.state.counts[COUNTS.stale] = 1
    simulation.advance_once(1.0)
    assert clock[CLOCK.singular_pivot] == 0.0


@pytest.mark.parametrize("nearby", [False, True])
def test_other_orders_keep_the_sizes_that_were_written(nearby):
    """Sizes are numbers of the model, which an environment writes for each patient; so are tolerances, then."""
    world = World(model("bennett"))
    sizes = world.model.tables.values.scale_q, world.model.tables.values.scale_v
    for factor, size in zip((3.0, 5.0), sizes, strict=True):
        size *= factor
    assert world.reorder(nearby=nearby)
    assert world.tables is not world.model.tables
    for kept, size in zip((world.tables.values.scale_q, world.tables.values.scale_v), sizes, strict=True):
        np.testing.assert_array_equal(kept, size)


def test_the_motion_does_not_show_where_rows_were_chosen_anew():
    """Chosen anew every 50 ms for no reason, they are other ones, and the motion is the same but for rounding."""
    bennett, options = model("bennett"), SolverOptions(rtol=1e-6)
    plain, restless = Simulation(bennett, options), Simulation(bennett, options)
    chosen = set()
    for t in np.linspace(0.05, 1.0, 20):
        plain.advance(t)
        restless.advance(t)
        chosen.add(tuple(restless.tables.values.active))
        assert restless.reorder()
    assert len(chosen) > 2
    assert restless.stats().restarts == plain.stats().restarts == 1
    assert restless.stats().steps == pytest.approx(plain.stats().steps, rel=0.02)
    # Below the error of either run, a few times 1e-6: Newton's last digits, and with them the steps, differ a little.
    assert np.abs(restless.state.q - plain.state.q).max() < 5e-6


def test_the_force_of_the_joints_is_carried_over():
    """Multipliers of other rows exert the same force."""
    simulation = Simulation(model("bennett"), SolverOptions())
    simulation.advance(0.46)
    G = simulation.model.constraint_jacobian(simulation.state.q)[2]
    before, rows = G.T @ simulation.state.lam, simulation.tables.values.active
    assert simulation.reorder()
    assert not np.array_equal(simulation.tables.values.active, rows)
    # The old rows have a smallest singular value of 0.007 there.
    np.testing.assert_allclose(G.T @ simulation.state.lam, before, atol=1e-9 * np.abs(before).max())


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("name", "t_end"), [("stiff_blocks", 1e-4), ("chain_start", 1e-2)])
def test_the_order_of_elimination_fits_the_step(name, t_end, method):
    """In the order of a millisecond the pivots of these steps are rounding: both ended within the first microsecond."""
    simulation = Simulation(model(name), SolverOptions(rtol=1e-6, method=method))
    simulation.advance(t_end)
    run = simulation.trajectory().check()
    assert simulation.tables.values.c0_ordered[0] > 1e5
    # An exact linear solve shows in few iterations a step.
    assert run.stats.newton_iterations < (5 if method == "sdirk2" else 3) * run.stats.steps


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("name", "t_end"), [("chain_at_rest", 8.0), ("chain_and_lag", 2.0)])
def test_at_rest_rounding_is_no_failure(name, t_end, method):
    """What |M a| and |phi_q^T lam| leave of the rates is 1e-9 and more: they ended at 2 to 4 s, and at the jump."""
    run = simulate(model(name), t_end, SolverOptions(method=method)).check()
    mechanical = [k for k, n in enumerate(run.model.layout.names) if not n.startswith("lag")]
    assert np.abs(run.v[-1, mechanical]).max() < 1e-5

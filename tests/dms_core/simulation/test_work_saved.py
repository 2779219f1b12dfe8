"""What a step leaves out is what nobody needs: rows that rest, a matrix."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core import Model, Result, SolverOptions, World
from dms_core.assembly.residual import evaluate_residual
from dms_core.compiled.arena import Packed
from dms_core.model import MinimumJerk
from exo_env.ecosystem.ecosystem import Ecosystem

PERIOD = 0.02
ONE_STEP = SolverOptions(rtol=0.01, method="sdirk2", newton_tol=0.2)
"""As the environment runs."""


@pytest.fixture(scope="module")
def worn() -> Model:
    """Arm, device and machine: three of seven bodies are welded to the ground."""
    start, end = math.radians(40.0), math.radians(80.0)
    return Model(Ecosystem().system(start, MinimumJerk(times=(0.0, 0.8), values=(start, end))))


def test_rows_of_what_is_solved_for_are_those_of_all(worn):
    """To the last bit, with every multiplier and every rate at work; rows of welded bodies are left alone."""
    tables = worn.tables.values
    assert len(tables.free) < worn.n_q
    assert any(0 < np.diff(c.solved_ptr)[e] < np.diff(c.iq_ptr)[e] for c in (tables.dynamics, tables.constraints)
               for e in c.moving)  # fmt: skip
    found = []
    for dynamics, constraints in ((tables.dynamics, tables.constraints), (worn._dynamics, worn._constraints)):
        work = worn.new_work()
        rng = np.random.default_rng(0)
        for x in (work.v, work.a):
            x[tables.free] = rng.standard_normal(len(tables.free))
        work.lam[:], work.mu[:] = rng.standard_normal((2, worn.n_phi))
        work.u[:, 0] = 0.1
        calls = [c if isinstance(c, Packed) else Packed(c) for c in (dynamics, constraints)]
        evaluate_residual(calls[0].table, calls[1].table, Packed(work).table)
        found.append((work.r2[tables.free], work.gmu[tables.free], work.phi[tables.active], work.phi_v[tables.active]))
    for some, all_of_it in zip(*found, strict=True):
        assert np.abs(all_of_it).max() > 0.0
        assert np.array_equal(some, all_of_it)


def test_the_matrix_of_a_landing_is_for_the_next_steps(worn):
    """It is made for the size that these will have: nearly no step makes another one."""
    world, landings = World(worn, ONE_STEP), 40
    for k in range(landings):
        assert world.advance((k + 1) * PERIOD) is Result.SUCCESS
    stats = world.stats()
    # Two a landing: of the accelerations, and of the step that begins there. A rejected step makes one more. Made for
    # the size of the steps before the landing they were 99, of which 6 were made again as the size had changed.
    assert stats.factorisations <= 2.25 * landings + stats.rejected_error + stats.rejected_newton

"""What an adjoint costs, counted in factorised matrices, corrections and evaluations, so that no clock is needed."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import SolverOptions
from dms_core.sensitivity import record as record_module
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import Output, Sensitivity, Shift
from dms_core.sensitivity.tangents.tables import KIND
from dms_core.simulation.state import COUNTS
from tests.dms_core.sensitivity.systems import arm

OFTEN = 1.2
"""Factorised matrices a stage: one, each with one evaluation of all derivatives, and a few where steps change size. It
was 1.5 to 1.7 with a matrix for the iteration and another for the derivative."""
CORRECTIONS = 4.0
"""Corrections a stage with the factors of another one."""


def _episode(method: str) -> RecordedWorld:
    """A quarter of a second of the arm, the command of which jumps every 20 ms."""
    world = RecordedWorld(arm(), SolverOptions(rtol=1e-4, method=method))
    for k in range(12):
        world.set_input("assistance", 0.9 + 0.1 * (-1) ** k)
        world.advance((k + 1) * 0.02)
    return world


def _counts(run: Sensitivity) -> tuple[float, float]:
    """Matrices and corrections of an adjoint, a stage of the run: SDIRK2 has two a step, BDF2 one."""
    before = run.replay.state.counts.copy()
    run.adjoint()
    spent, record = run.replay.state.counts - before, run.record
    begins = [k for k in range(len(record.times) - 1) if not record.row(k + 1).start]
    stages = sum(2 if record.kind(k) == KIND.sdirk2 else 1 for k in begins)
    return spent[COUNTS.factorisations] / stages, spent[COUNTS.iterations] / stages


@pytest.mark.parametrize("method", ["sdirk2", "bdf2"])
def test_adjoint_factorises_one_matrix_a_stage(method):
    shifts = [Shift("assistance", 0.02 * k, 0.02 * (k + 1)) for k in range(12)]
    run = Sensitivity(_episode(method), [Output("q.forearm.x")], [*shifts, Number("forearm", "mass")])
    matrices, corrections = _counts(run)
    assert matrices < OFTEN
    assert corrections < CORRECTIONS


@pytest.mark.parametrize(("method", "most"), [("sdirk2", 0.8), ("bdf2", 2.5)])
def test_sensors_on_the_way_cost_a_matrix_each(method, most):
    """An integral reads the accelerations of each row: a correction with their matrix, two behind a step of BDF2."""
    world = _episode(method)
    plain = Sensitivity(world, [Output("q.forearm.x")], [Shift("assistance")])
    integral = Sensitivity(world, [Output("elbow_angle.acceleration", integral=True)], [Shift("assistance")])
    assert 0.4 < _counts(integral)[0] - _counts(plain)[0] < most


def test_steps_between_kept_states_are_solved_once_more_and_not_differentiated(monkeypatch):
    """A long run, of which every eighth state is kept: less than another matrix a stage."""
    whole = _episode("bdf2")
    with monkeypatch.context() as m:
        m.setattr(record_module, "MOST_STATES", len(whole.times) // 5)
        few = _episode("bdf2")
    assert few.stride == 8
    of, by = [Output("q.forearm.x")], [Shift("assistance")]
    assert _counts(Sensitivity(few, of, by))[0] - _counts(Sensitivity(whole, of, by))[0] < 0.9
    one, other = (Sensitivity(world, of, by).adjoint() for world in (few, whole))
    # States that are computed again are those of the run within the tolerance of Newton's method.
    np.testing.assert_allclose(one, other, rtol=1e-3)

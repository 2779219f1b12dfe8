"""What an adjoint costs, counted in factorised matrices, corrections and evaluations, so that no clock is needed."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import SolverOptions
from dms_core.sensitivity import record as record_module
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import Output, Sensitivity, Shift
from dms_core.simulation.state import COUNTS
from tests.dms_core.sensitivity.systems import SYSTEMS, pendulum

STAGES = {"sdirk2": 2, "bdf2": 1}
OFTEN = 1.15
"""Factorised matrices a stage: one, each with one evaluation of all derivatives, and a few where steps change size. It
was 1.5 to 1.7 with a matrix for the iteration and another for the derivative."""
CORRECTIONS = 4.0
"""Corrections a stage with the factors of another one; the run itself takes two."""


def _episode(name: str, method: str) -> RecordedWorld:
    """A quarter of a second, the command of which jumps every 20 ms."""
    world = RecordedWorld(SYSTEMS[name](), SolverOptions(rtol=1e-4, method=method))
    command = {"arm": "assistance", "pendulum": "moment"}[name]
    for k in range(12):
        world.set_input(command, 0.9 + 0.1 * (-1) ** k)
        world.advance((k + 1) * 0.02)
    return world


def _counts(run: Sensitivity) -> tuple[float, float]:
    """Matrices and corrections of an adjoint, a step of the run."""
    before = run.replay.state.counts.copy()
    run.adjoint()
    spent, steps = run.replay.state.counts - before, run.record.stats().steps
    return spent[COUNTS.factorisations] / steps, spent[COUNTS.iterations] / steps


@pytest.mark.parametrize("method", STAGES)
@pytest.mark.parametrize("name", ["arm", "pendulum"])
def test_adjoint_factorises_one_matrix_a_stage(name, method):
    world = _episode(name, method)
    command, number = (
        ("assistance", Number("forearm", "mass")) if name == "arm" else ("moment", Number("lower", "mass"))
    )
    shifts = [Shift(command, 0.02 * k, 0.02 * (k + 1)) for k in range(12)]
    state = "q.forearm.x" if name == "arm" else "q.lower.x"
    matrices, corrections = _counts(Sensitivity(world, [Output(state)], [*shifts, number]))
    assert matrices < OFTEN * STAGES[method]
    assert corrections < CORRECTIONS * STAGES[method]


def test_sensors_on_the_way_cost_a_few_matrices_each():
    """An integral reads the accelerations of each row: a Newton iteration for these, and no more."""
    world = _episode("arm", "sdirk2")
    plain = Sensitivity(world, [Output("q.forearm.x")], [Shift("assistance")])
    integral = Sensitivity(world, [Output("elbow_angle.acceleration", integral=True)], [Shift("assistance")])
    assert _counts(integral)[0] - _counts(plain)[0] < 3.0


def test_steps_between_kept_states_are_solved_once_more_and_not_differentiated(monkeypatch):
    """A long run, of which every eighth state is kept: less than two matrices more a step."""
    whole = _episode("arm", "bdf2")
    with monkeypatch.context() as m:
        m.setattr(record_module, "MOST_STATES", len(whole.times) // 5)
        few = _episode("arm", "bdf2")
    assert few.stride == 8
    of, by = [Output("q.forearm.x")], [Shift("assistance")]
    assert _counts(Sensitivity(few, of, by))[0] - _counts(Sensitivity(whole, of, by))[0] < 1.0
    one, other = (Sensitivity(world, of, by).adjoint() for world in (few, whole))
    np.testing.assert_allclose(one, other, rtol=1e-4)

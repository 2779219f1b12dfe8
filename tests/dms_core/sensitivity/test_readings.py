"""Sensors pulled back in compiled code, against their elimination in independent coordinates (nodes.py)."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import SolverOptions
from dms_core.sensitivity.nodes import Number, node, start_columns
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.replay import Replay
from dms_core.sensitivity.run import Output, Sensitivity, Shift
from tests.dms_core.sensitivity.systems import arm, crank_and_rocker, pendulum

CASES = {
    "arm": (arm, [Number("forearm", "mass"), Number("BIClong", "max_isometric_force"), Number("pid", "kp")]),
    "pendulum": (pendulum, [Number("elbow", "point_i.0"), Number("weight", "acceleration.1")]),
    "crank_and_rocker": (crank_and_rocker, [Number("crank_pin", "point_i.0"), Number("coupler", "mass")]),
}
SAME = 1e-6
"""Of the largest derivative of a sensor: both difference ((phi_q v)_q v)_q, each along other directions."""
ROUNDING = 1e-8
"""Of forces of 1000 N, where a component is 0."""


def _record(name: str, method: str = "sdirk2") -> RecordedWorld:
    world = RecordedWorld(CASES[name][0](), SolverOptions(rtol=1e-5, method=method))
    world.advance(0.04)
    return world


@pytest.mark.parametrize("name", CASES)
def test_sensors_are_those_of_independent_coordinates(name):
    """By independent states, by inputs, and by numbers, which move the other coordinates too."""
    record, numbers = _record(name), CASES[name][1]
    replay, model = Replay(record, numbers, range(len(record.model.layout.input_index))), record.model
    rows = list(range(len(model.layout.outputs)))
    for k in (0, len(record.times) // 2, len(record.times) - 1):
        found, point = replay.node(k, rows), replay.point(k)
        expected = node(model, point, np.array(rows), replay.numbers, replay.directions)
        _, dq, dv = start_columns(model, point, numbers)
        n_x = len(dq) - len(numbers)
        one, other = (x.by_q @ dq.T + x.by_v @ dv.T for x in (found, expected))
        one[:, n_x:] += found.by_p
        other[:, n_x:] += expected.by_p
        size = np.abs(other).max(axis=1, keepdims=True)
        assert np.all(np.abs(one - other) < SAME * size + ROUNDING)
        np.testing.assert_allclose(found.y, expected.y, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found.by_u, expected.by_u, rtol=1e-8, atol=1e-8 * np.abs(expected.by_u).max())


@pytest.mark.parametrize("method", ["sdirk2", "bdf2"])
def test_integrals_on_the_way_are_those_of_the_forward_pass(method):
    """Several integrals beside outputs at times, summed by weights; muscles' inputs move the moment that they sum."""
    record = _record("arm", method)
    muscle = next(x.name for x in record.model.system.inputs if x.name not in record.model.layout.driven)
    of = [
        Output("elbow_reaction.Fy", integral=True), Output("muscle_moment", integral=True),
        Output("elbow_angle.angle"), Output("agonist_tension", integral=True), Output("q.forearm.x"),
    ]  # fmt: skip
    for by in ([Number("forearm", "mass"), Shift("assistance")], [Shift(muscle), Number("pid", "kp")]):
        run = Sensitivity(record, of, by)
        forward, weights = run.forward(), np.array([[1.0, -2.0, 3.0, 0.5, 1.0], [0.0, 1.0, 0.0, 0.0, 0.0]])
        size = np.abs(forward).max(axis=0)
        # Elbow forces of 1000 N in sums of some hundred rows.
        np.testing.assert_allclose(run.adjoint(weights=weights) / size, weights @ forward / size, atol=1e-8)

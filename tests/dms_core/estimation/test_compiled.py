"""The compiled filter is the filter: the same means, covariances and NIS."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model
from dms_core.errors import InputError, SimulationError
from dms_core.estimation import Bias, Channel, EstimatedInput, FilterSettings, KalmanFilter
from dms_core.estimation.filter.compiled_filter import CompiledFilter
from tests.dms_core.estimation.systems import driven_four_bar, masses, slider_crank
from tests.dms_core.estimation.test_observability import two_muscles

CASES = {
    "masses": (masses, {"at1.position.x": (0.01, 2.0), "at0.velocity.x": (0.05, 0.0)}, "force"),
    "four-bar": (driven_four_bar, {"crank_angle.angle": (1e-3, 0.8), "crank_angle.acceleration": (0.5, 0.0)}, "torque"),
    "slider-crank": (slider_crank, {"encoder.angle": (1e-3, 0.7)}, "force"),
    "muscles": (two_muscles, {"angle.angle": (1e-3, 0.0)}, "drive of one"),
}


@pytest.mark.parametrize("case", CASES)
def test_it_is_the_filter_in_python(case):
    made, channels, unknown = CASES[case]
    names = list(channels)
    biased = {names[0]: Channel(deviation=channels[names[0]][0], bias=Bias(deviation=0.01, walk=0.001))}
    settings = FilterSettings(
        period=0.002, steps=2, channels={**{n: Channel(deviation=d) for n, (d, _) in channels.items()}, **biased},
        inputs={unknown: EstimatedInput(deviation=0.2, time_constant=0.2)}, noise={"rate": 0.01},
        initial={"position": 0.01, "velocity": 0.1, "state": 0.01},
    )  # fmt: skip
    kalman, quick = KalmanFilter(Model(made()), settings), CompiledFilter(Model(made()), settings)
    rng, belief = np.random.default_rng(3), kalman.start()
    for k in range(25):
        readings = {n: value + deviation * rng.normal() for n, (deviation, value) in channels.items()}
        if k % 7 == 3:
            readings[names[-1]] = float("nan")
        if k:
            belief = kalman.predict(belief, 0.002 * k).belief
            quick.step(readings)
        else:
            quick.correct(readings)
        correction = kalman.correct(belief, readings)
        belief, found = correction.belief, quick.belief()
        # Differences of sensors are good to about 1e-8 of their size.
        size = np.sqrt(np.diag(belief.P))
        assert found.chart.names == belief.chart.names
        np.testing.assert_allclose(found.mean / size, belief.mean / size, atol=1e-4)
        np.testing.assert_allclose(found.P / np.outer(size, size), belief.P / np.outer(size, size), atol=1e-5)
        assert quick.nis[0] == pytest.approx(correction.nis, rel=1e-4, abs=1e-6)


def test_states_stay_on_the_constraints():
    model = Model(driven_four_bar())
    quick = CompiledFilter(model, FilterSettings(channels={"crank_angle.angle": {"deviation": 0.001}}))
    for _ in range(20):
        quick.step({"crank_angle.angle": 0.9})
    found = quick.belief()
    phi, phi_v, _, _ = model.constraint_jacobian(found.q, found.v)
    assert np.abs(phi).max() < 1e-10
    assert np.abs(phi_v).max() < 1e-10


def test_other_forms_are_refused():
    with pytest.raises(InputError, match="without constants and bounds"):
        CompiledFilter(Model(masses()), FilterSettings(channels={"at0.position.x": {"deviation": 1}}, form="iterated"))


def test_what_it_cannot_follow_is_said_and_the_belief_stays():
    quick = CompiledFilter(
        Model(driven_four_bar()), FilterSettings(channels={"rocker_angle.angle": {"deviation": 1e-6}})
    )
    before = quick.belief()
    with pytest.raises(SimulationError, match="compiled filter"):
        for _ in range(5):
            before = quick.belief()
            quick.step({"rocker_angle.angle": 0.2})
    np.testing.assert_array_equal(quick.belief().q, before.q)

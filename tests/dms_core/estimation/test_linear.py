"""On linear models the filter is the Kalman filter, the smoother least squares, and both are consistent."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la
from scipy.stats import chi2

from dms_core import Model
from dms_core.estimation import Channel, EstimatedInput, FilterSettings
from dms_core.estimation.filter.forms import filter_of
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.estimation.measurement import Measurements
from dms_core.estimation.record import estimate
from dms_core.estimation.settings import InitialDeviations, MotionNoise
from tests.dms_core.estimation import textbook
from tests.dms_core.estimation.systems import masses

PERIOD = 0.02
DIGITS = 1e-10
"""Agreement of two ways through the same linear algebra, over numbers of size 1: Newton's method stops at 1e-13."""


def settings(**changes) -> FilterSettings:
    return FilterSettings(
        **{
            "period": PERIOD,
            "channels": {"at1.position.x": Channel(deviation=0.01), "at0.velocity.x": Channel(deviation=0.05)},
            "inputs": {"force": EstimatedInput(deviation=1.5, time_constant=0.3)},
            "noise": MotionNoise(acceleration=0.3),
            "initial": InitialDeviations(position=0.05, velocity=0.2),
            **changes,
        }
    )


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(masses())


class Discrete:
    """The linear system that a filter works with: x1 - m = A (x0 - m) with noise Q, y - h(m) = C (x - m)."""

    def __init__(self, kalman: KalmanFilter) -> None:
        self.start = kalman.start()
        self.A = kalman.predict(self.start, PERIOD).A
        self.Q = kalman.estimated.noise(self.start.chart, PERIOD)
        self.h, self.C = kalman.expected(self.start, list(kalman.settings.channels))
        self.R = np.diag([c.variance for c in kalman.settings.channels.values()])


@pytest.fixture(scope="module")
def record() -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.column_stack([2.0 + 0.05 * rng.normal(size=30), 0.1 * rng.normal(size=30)])


class TestTextbook:
    @pytest.mark.parametrize("form", ["extended", "iterated", "unscented"])
    def test_filter_is_the_kalman_filter(self, model, record, form):
        kalman = filter_of(model, settings(form=form))
        d = Discrete(KalmanFilter(model, settings()))
        belief, m = kalman.start(), d.start.mean
        x, P = np.zeros(len(m)), belief.P
        for k, y in enumerate(record):
            if k:
                belief = kalman.predict(belief, k * PERIOD).belief
                x, P = textbook.predict(x, P, d.A, d.Q)
            correction = kalman.correct(belief, dict(zip(kalman.settings.channels, y, strict=True)))
            belief = correction.belief
            x, P, nis = textbook.correct(x, P, d.C, d.R, y - d.h)
            np.testing.assert_allclose(belief.mean, m + x, atol=DIGITS * 10.0, rtol=0.0)
            np.testing.assert_allclose(belief.P, P, atol=DIGITS, rtol=0.0)
            assert correction.nis == pytest.approx(nis, rel=1e-7)

    def test_covariance_in_the_long_run_solves_the_riccati_equation(self, model):
        kalman = KalmanFilter(model, settings())
        d = Discrete(kalman)
        expected = la.solve_discrete_are(d.A.T, d.C.T, d.Q, d.R)
        belief = kalman.start()
        for k in range(300):
            belief = kalman.correct(belief, dict(zip(kalman.settings.channels, d.h, strict=True))).belief
            belief = kalman.predict(belief, (k + 1) * PERIOD).belief
        np.testing.assert_allclose(belief.P, expected, atol=DIGITS * np.abs(expected).max())

    def test_a_missing_reading_is_one_channel_less(self, model):
        kalman = KalmanFilter(model, settings())
        both = {"at1.position.x": 2.01, "at0.velocity.x": float("nan")}
        one = kalman.correct(kalman.start(), {"at1.position.x": 2.01})
        found = kalman.correct(kalman.start(), both)
        assert len(found.residual) == 1
        np.testing.assert_array_equal(found.belief.P, one.belief.P)

    def test_prediction_alone_adds_noise_only(self, model):
        kalman = KalmanFilter(model, settings())
        d, start = Discrete(kalman), kalman.start()
        np.testing.assert_allclose(kalman.predict(start, PERIOD).belief.P, d.A @ start.P @ d.A.T + d.Q, atol=1e-15)


class TestSmoother:
    def test_smoothed_states_are_those_of_least_squares(self, model, record):
        kalman = KalmanFilter(model, settings())
        d, t = Discrete(kalman), PERIOD * np.arange(len(record))
        found = estimate(kalman, Measurements(t, tuple(kalman.settings.channels), record, {}), smooth=True)
        x = textbook.least_squares(np.zeros(len(d.A)), d.start.P, d.A, d.Q, d.C, d.R, record - d.h)
        means = np.array([belief.mean for belief in found.beliefs])
        # Weights of the least squares span 1e6, which costs as many digits.
        np.testing.assert_allclose(means, d.start.mean + x, atol=1e-8)

    def test_it_knows_more_than_the_filter(self, model, record):
        kalman = KalmanFilter(model, settings())
        t = PERIOD * np.arange(len(record))
        measured = Measurements(t, tuple(kalman.settings.channels), record, {})
        filtered, smooth = (estimate(kalman, measured, smooth=x) for x in (False, True))
        assert smooth.rest("input.force")[1][5] < 0.9 * filtered.rest("input.force")[1][5]
        np.testing.assert_array_equal(smooth.beliefs[-1].P, filtered.beliefs[-1].P)


class TestConsistency:
    SEEDS, STEPS = 100, 12

    def test_errors_are_as_large_as_they_are_said_to_be(self, model):
        """NEES and NIS over seeds within the 95 % bands of chi^2 (Bar-Shalom, Li and Kirubarajan 2001, sect. 5.4)."""
        kalman = KalmanFilter(model, settings())
        d, m = Discrete(kalman), kalman.start().mean
        root_0, root_Q = np.linalg.cholesky(d.start.P), np.linalg.cholesky(d.Q)
        nees, nis = [], []
        for seed in range(self.SEEDS):
            rng = np.random.default_rng(1000 + seed)
            x = root_0 @ rng.normal(size=len(m))
            belief = kalman.start()
            for k in range(self.STEPS):
                if k:
                    x = d.A @ x + root_Q @ rng.normal(size=len(m))
                    belief = kalman.predict(belief, k * PERIOD).belief
                y = d.h + d.C @ x + np.sqrt(np.diag(d.R)) * rng.normal(size=len(d.R))
                correction = kalman.correct(belief, dict(zip(kalman.settings.channels, y, strict=True)))
                belief = correction.belief
                nis.append(correction.nis)
            error = belief.mean - m - x
            nees.append(error @ np.linalg.solve(belief.P, error))
        # Errors at one time of different seeds are independent, and so are all innovations of a consistent filter.
        for found, count in ((nees, len(m) * self.SEEDS), (nis, len(d.R) * self.SEEDS * self.STEPS)):
            low, high = chi2.ppf([0.025, 0.975], count)
            assert low <= sum(found) <= high

    def test_a_filter_that_believes_in_less_noise_is_found_out(self, model, record):
        doubtless = settings(channels={"at1.position.x": Channel(deviation=0.003)})
        kalman, rng = KalmanFilter(model, doubtless), np.random.default_rng(5)
        y = 2.0 + 0.01 * rng.normal(size=(30, 1))
        measured = Measurements(PERIOD * np.arange(30), ("at1.position.x",), y, {})
        found = estimate(kalman, measured)
        assert found.nis.sum() > chi2.ppf(0.999, found.readings.sum())

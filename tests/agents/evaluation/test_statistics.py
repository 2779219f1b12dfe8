"""Interquartile mean and bootstrap against scipy."""

import numpy as np
import pytest
from scipy import stats

from agents.evaluation.comparison.statistics import estimate, interquartile_mean, mean


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7, 8, 20, 101])
def test_interquartile_mean_is_scipys_trimmed_mean(count):
    values = np.random.default_rng(count).standard_t(2.0, count)
    # Same numbers, possibly summed in another order.
    assert interquartile_mean(values) == pytest.approx(stats.trim_mean(values, 0.25), rel=1e-12, abs=1e-14)


def test_one_outlier_does_not_move_the_interquartile_mean():
    values = np.arange(8.0)
    spoiled = np.append(values[:-1], 1e9)
    assert interquartile_mean(spoiled) == interquartile_mean(values)


@pytest.mark.parametrize("statistic", [interquartile_mean, mean])
def test_interval_is_that_of_scipys_percentile_bootstrap(statistic):
    values = np.random.default_rng(3).gamma(2.0, 5.0, 40)
    found = estimate(values, statistic, np.random.default_rng(0))
    other = stats.bootstrap(
        (values,), lambda x, axis: statistic(np.moveaxis(x, axis, -1)), n_resamples=20000, method="percentile",
        confidence_level=0.95, rng=np.random.default_rng(1), vectorized=True,
    )  # fmt: skip
    # An end of the interval is a quantile of 5000 draws: its standard error is about 4 % of the statistic's.
    assert found.value == statistic(values)
    assert found.low == pytest.approx(other.confidence_interval.low, abs=0.2 * other.standard_error)
    assert found.high == pytest.approx(other.confidence_interval.high, abs=0.2 * other.standard_error)


def test_several_trainings_are_averaged_and_resampled():
    generator = np.random.default_rng(7)
    patients = generator.normal(size=50)
    same, apart = np.tile(patients, (4, 1)), patients + np.array([[-3.0], [-1.0], [1.0], [3.0]])
    alone, equal, spread = (estimate(v, mean, np.random.default_rng(0)) for v in (patients, same, apart))
    assert (equal.value, equal.low, equal.high) == pytest.approx((alone.value, alone.low, alone.high))
    assert spread.value == pytest.approx(alone.value) and spread.count == 50
    # Errors of patients and trainings add up: sd^2 / 50 + 5 / 4, the ends at 1.96 of its root.
    wanted = 1.96 * np.sqrt(patients.var() / 50 + 5.0 / 4)
    # Four trainings have few means, so that quantiles of them are coarse.
    assert spread.high - spread.value == pytest.approx(wanted, rel=0.15)
    # A patient who could not be measured in one training counts in none.
    same[2, 5] = np.nan
    assert estimate(same, mean, np.random.default_rng(0)).count == 49


def test_interval_depends_on_the_seed_alone():
    values = np.random.default_rng(3).normal(size=30)
    first, again, other = (estimate(values, mean, np.random.default_rng(s)) for s in (0, 0, 1))
    assert first == again
    assert first.low != other.low


def test_what_is_not_finite_is_left_out_and_counted():
    found = estimate(np.array([1.0, np.nan, 3.0]), mean, np.random.default_rng(0))
    assert (found.value, found.count) == (2.0, 2)


def test_nothing_to_estimate():
    found = estimate(np.array([np.nan]), mean, np.random.default_rng(0))
    assert np.isnan(found.value) and found.count == 0

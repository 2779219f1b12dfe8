"""Sums of submovements against their formula."""

import math

import numpy as np

from exo_env.tasks.movements.course import course_of
from exo_env.tasks.movements.submovements import put_sum

UNITS = np.array([[0.5, 1.2, 40.0], [1.1, 1.5, -25.0], [3.0, 0.8, 10.0], [0.0, 1.0, 0.0]])


def course(units, times, start=30.0):
    n = 2 * len(units) + 1
    t, c, out = np.empty(n), np.empty((n, 6)), np.empty((len(times), 3))
    put_sum(start, units, t, c)
    course_of(t, c, times, out)
    return out


def formula(units, times, start=30.0):
    """psi_0 + sum a s((t - t_i) / T_i), shape (k,)."""
    total = np.full(len(times), math.radians(start))
    for onset, duration, amplitude in units:
        x = np.clip((times - onset) / duration, 0.0, 1.0)
        total += math.radians(amplitude) * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    return total


def test_sum_is_that_of_the_formula():
    times = np.linspace(0.0, 5.0, 1001)
    # Polynomials of degree 5 about other points: rounding only.
    np.testing.assert_allclose(course(UNITS, times)[:, 0], formula(UNITS, times), atol=1e-12)


def test_rates_and_accelerations_are_derivatives():
    times, h = np.linspace(0.05, 4.95, 197), 1e-5
    found = course(UNITS, times)
    for k in (0, 1):
        by_difference = (course(UNITS, times + h)[:, k] - course(UNITS, times - h)[:, k]) / (2.0 * h)
        # Central differences err by h^2 / 6 times the third derivative, some 50 rad/s^3, and where the jerk jumps by h.
        np.testing.assert_allclose(found[:, k + 1], by_difference, atol=1e-3)


def test_accelerations_do_not_jump():
    times = np.linspace(0.0, 5.0, 200_001)
    # Jerk is at most 60 a / T^3, below 80 rad/s^3 for each of these: 2e-3 rad/s^2 in 25 us.
    assert np.abs(np.diff(course(UNITS, times)[:, 2])).max() < 8e-3


def test_without_submovements_psi_stays():
    still = course(np.array([[0.0, 1.0, 0.0]] * 3), np.linspace(0.0, 9.0, 10), start=50.0)
    np.testing.assert_array_equal(still, [[math.radians(50.0), 0.0, 0.0]] * 10)


def test_submovements_that_begin_together_add_up():
    both = np.array([[0.3, 1.0, 10.0], [0.3, 1.0, 20.0]])
    times = np.linspace(0.0, 2.0, 101)
    np.testing.assert_allclose(course(both, times), course(np.array([[0.3, 1.0, 30.0]]), times), atol=1e-12)

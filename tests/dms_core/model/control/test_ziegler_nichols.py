"""The critical-gain experiment on plants whose critical gain and period are known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lti, step

from dms_core.errors import InputError
from dms_core.model.control.ziegler_nichols import STEP, Gains, find_critical_gain, oscillation, ziegler_nichols

T = np.linspace(0.0, 60.0, 6001)


def triple_lag(kp: float) -> tuple[np.ndarray, np.ndarray]:
    """Closed loop of kp and 1 / (s + 1)^3: kp / (s^3 + 3 s^2 + 3 s + 1 + kp); Routh: Kc = 8, w = sqrt 3."""
    return T, STEP * step(lti([kp], [1.0, 3.0, 3.0, 1.0 + kp]), T=T)[1]


def servo(kp: float) -> tuple[np.ndarray, np.ndarray]:
    """A damped inertia behind a lag, kp / (s (s + 2) (0.1 s + 1)): Kc = 2 (1 + 0.2) / 0.1 = 24, w^2 = 2 / 0.1 = 20."""
    closed = lti([kp], [0.1, 1.2, 2.0, kp])
    t = np.linspace(0.0, 20.0, 8001)
    return t, STEP * step(closed, T=t)[1]


@pytest.mark.parametrize(
    ("plant", "bracket", "Kc", "Tc"),
    [
        (triple_lag, (1.0, 30.0), 8.0, 2.0 * math.pi / math.sqrt(3.0)),
        (servo, (2.0, 200.0), 24.0, 2.0 * math.pi / math.sqrt(20.0)),
    ],
)
def test_finds_the_critical_gain_and_period_of_routh(plant, bracket: tuple, Kc: float, Tc: float) -> None:
    """Both closed forms are the limit of stability of the third-order polynomial (Routh 1877)."""
    found = find_critical_gain(plant, *bracket, tolerance=1e-4)
    # The bracket is 1e-4 wide; the rest is the growth of -1e-4 that counts as sustained and the sampling.
    assert found.Kc == pytest.approx(Kc, rel=1e-3)
    assert found.Tc == pytest.approx(Tc, rel=1e-3)
    assert found.bracket[1] / found.bracket[0] - 1.0 <= 1e-4


def test_growth_is_that_of_the_signal() -> None:
    """The swing of c + exp(s t) sin(w t) grows by s pi / w over half an oscillation, and its offset does not matter."""
    s, w = -0.05, 4.0
    found = oscillation(T, 0.3 + np.exp(s * T) * np.sin(w * T))
    # Line fit over samples of 1/150 period; the parabola's error is of fourth order in it.
    assert found.growth == pytest.approx(s * math.pi / w, rel=1e-4)
    assert found.period == pytest.approx(2.0 * math.pi / w, rel=1e-4)


def test_a_limit_cycle_counts_as_sustained() -> None:
    """A constant swing has a growth of rounding size, on either side of zero."""
    # Extrema by parabolas are off by 1e-8 of the swing at this sampling.
    assert abs(oscillation(T, np.sin(4.0 * T)).growth) < 1e-6


def test_settled_and_diverged_responses() -> None:
    """No swings at all, and a record that overflowed."""
    assert oscillation(T, 1.0 - np.exp(-T)).growth == -math.inf
    assert oscillation(T, np.where(T < 30.0, np.sin(T), np.inf)).growth == math.inf


def test_gains_follow_the_rule() -> None:
    """Kp = 0.6 Kc, Ki = Kp / (0.5 Tc), Kd = 0.125 Kp Tc, and Ki / 500."""
    assert ziegler_nichols(10.0, 0.4, integral_divisor=1.0) == Gains(kp=6.0, ki=30.0, kd=pytest.approx(0.3))
    assert ziegler_nichols(10.0, 0.4).ki == pytest.approx(0.06)


def test_gains_of_the_paper() -> None:
    """Kc = 9e6 and Tc = 0.091 s, the values found there."""
    gains = ziegler_nichols(9e6, 0.091)
    assert (gains.kp, gains.ki, gains.kd) == pytest.approx((5.4e6, 5.4e6 / 0.0455 / 500.0, 0.125 * 5.4e6 * 0.091))


@pytest.mark.parametrize(
    ("bracket", "message"),
    [
        ((20.0, 30.0), "already oscillates"),
        ((1.0, 5.0), "still decays"),
        ((5.0, 1.0), "got 5.0 and 1.0"),
    ],
)
def test_gains_that_bracket_nothing_are_refused(bracket: tuple, message: str) -> None:
    """Each mistake with what to change."""
    with pytest.raises(InputError, match=message):
        find_critical_gain(triple_lag, *bracket)


@pytest.mark.parametrize("values", [(0.0, 1.0), (1.0, -1.0), (math.nan, 1.0)])
def test_impossible_experiment_is_refused(values: tuple) -> None:
    """Gain and period are positive numbers."""
    with pytest.raises(InputError, match="must be positive"):
        ziegler_nichols(*values)

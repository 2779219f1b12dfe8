"""Ziegler-Nichols tuning by the experiment of the critical gain (paper sect. 3.5; Ziegler and Nichols 1942).

The proportional gain is raised alone until a step of 9 degrees gives an oscillation that neither grows nor decays, at
gain K_c and period T_c. Then

    Kp = 0.6 Kc,   Ki = Kp / (0.5 Tc),   Kd = 0.125 Kp Tc

and the paper divides Ki by 500 by hand. The experiment itself is a function kp -> (t, theta) of the caller.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dms_core.errors import InputError

STEP = math.radians(9.0)
"""Step of the reference in the paper's experiment [rad]."""
INTEGRAL_DIVISOR = 500.0
"""By which the paper reduces Ki after the rule."""
TRANSIENT = 0.5
"""Share of a record that is left out, so that faster modes have died away."""
SWINGS = 4
"""Least number of half oscillations from which growth is judged; fewer mean that the response has settled."""
SETTLED = 1e-4
"""Swings below this share of the largest deviation of a record count as settled."""

SUSTAINED = -1e-4
"""Growth from which on an oscillation counts as sustained: a limit cycle keeps its swing up to rounding."""

Response = Callable[[float], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Oscillation:
    """What a step response does behind its transient."""

    growth: float
    """Relative growth of the swing over half an oscillation, as a logarithm [-]; -inf for a settled response."""
    period: float
    """Duration of a full oscillation [s]; nan for a settled response."""


@dataclass(frozen=True)
class CriticalGain:
    """Result of the experiment."""

    Kc: float
    """Gain of the sustained oscillation [unit of kp]."""
    Tc: float
    """Its period [s]."""
    bracket: tuple[float, float]
    """Largest gain that decayed and smallest that did not [unit of kp]."""
    trials: tuple[tuple[float, float], ...]
    """(gain, growth) of every response that was computed."""


@dataclass(frozen=True)
class Gains:
    """Gains of a PID controller."""

    kp: float
    """Proportional [N/rad]."""
    ki: float
    """Integral [N/(rad s)]."""
    kd: float
    """Derivative [N s/rad]."""


def ziegler_nichols(Kc: float, Tc: float, *, integral_divisor: float = INTEGRAL_DIVISOR) -> Gains:
    """Gains from critical gain [N/rad] and period [s]; `integral_divisor` = 1 gives the rule of 1942 unchanged."""
    for name, value in (("Kc", Kc), ("Tc", Tc), ("integral_divisor", integral_divisor)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"ziegler_nichols: {name} = {value!r} must be positive.")
    kp = 0.6 * Kc
    return Gains(kp=kp, ki=kp / (0.5 * Tc) / integral_divisor, kd=0.125 * kp * Tc)


def _extrema(t: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and values of the local extrema of a record: vertices of parabolas through three samples."""
    d = np.diff(x)
    k = np.flatnonzero(d[:-1] * d[1:] < 0.0) + 1
    h0, h1 = t[k] - t[k - 1], t[k + 1] - t[k]
    s0, s1 = d[k - 1] / h0, d[k] / h1
    curvature = (s1 - s0) / (h0 + h1)
    slope = (s0 * h1 + s1 * h0) / (h0 + h1)
    return t[k] - 0.5 * slope / curvature, x[k] - 0.25 * slope**2 / curvature


def _zero_crossings(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Times at which x changes sign, by linear interpolation [s]."""
    k = np.flatnonzero(np.signbit(x[:-1]) != np.signbit(x[1:]))
    return t[k] - x[k] * (t[k + 1] - t[k]) / (x[k + 1] - x[k])


def oscillation(t: np.ndarray, theta: np.ndarray) -> Oscillation:
    """Growth and period of a step response.

    Growth is the slope of a line through the logarithms of successive swings (from extremum to extremum, so that the
    offset which a proportional controller leaves does not matter). The period comes from the zero crossings of what
    is left when the line through the midpoints of the swings is taken off.

    Args:
        t: increasing times [s], shape (n,).
        theta: response [rad], shape (n,). A record that ends in numbers that are not finite has grown without bound.

    Raises:
        InputError: the arrays do not match or hold fewer than three samples.
    """
    t, theta = np.asarray(t, float), np.asarray(theta, float)
    if t.ndim != 1 or t.shape != theta.shape or len(t) < 3:
        raise InputError(
            f"response: t and theta have shapes {t.shape} and {theta.shape}; give two equal ones, (n >= 3,)."
        )
    if not np.all(np.isfinite(theta)):
        return Oscillation(math.inf, math.nan)
    late = t >= t[0] + TRANSIENT * (t[-1] - t[0])
    t_late, x = t[late], theta[late]
    times, values = _extrema(t_late, x)
    swings = np.abs(np.diff(values))
    floor = SETTLED * np.max(np.abs(theta - theta[0]))
    if len(swings) < SWINGS or np.max(swings) <= floor:
        return Oscillation(-math.inf, math.nan)
    growth = np.polyfit(np.arange(len(swings)), np.log(np.maximum(swings, floor)), 1)[0]
    middle = np.polyfit(0.5 * (times[1:] + times[:-1]), 0.5 * (values[1:] + values[:-1]), 1)
    crossings = _zero_crossings(t_late, x - np.polyval(middle, t_late))
    if len(crossings) < 2:
        return Oscillation(-math.inf, math.nan)
    half = np.polyfit(np.arange(len(crossings)), crossings, 1)[0]
    return Oscillation(float(growth), float(2.0 * half))


def find_critical_gain(
    response: Response, kp_low: float, kp_high: float, *, tolerance: float = 1e-3, max_trials: int = 60
) -> CriticalGain:
    """Bisect the logarithm of the gain between a response that decays and one that does not.

    Args:
        response: kp -> (t, theta), the response to a step (`STEP`) under proportional control alone, long enough for
            `SWINGS` half oscillations in its second half.
        kp_low: a gain whose response decays [N/rad].
        kp_high: a gain whose response does not [N/rad].
        tolerance: relative width of the bracket at which to stop [-].
        max_trials: largest number of responses.

    Raises:
        InputError: the gains do not bracket a sustained oscillation. A loop without delay or lag may have none.
    """
    if not 0.0 < kp_low < kp_high:
        raise InputError(f"Expected 0 < kp_low < kp_high, got {kp_low!r} and {kp_high!r}.")
    trials: list[tuple[float, float]] = []

    def measured(kp: float) -> Oscillation:
        found = oscillation(*response(kp))
        trials.append((kp, found.growth))
        return found

    low, high = measured(kp_low), measured(kp_high)
    if low.growth >= SUSTAINED:
        raise InputError(f"the response at kp_low = {kp_low:g} already oscillates without decay; choose a lower gain.")
    if high.growth < SUSTAINED:
        raise InputError(
            f"the response at kp_high = {kp_high:g} still decays; choose a higher gain. "
            "A loop without delay, lag or elasticity can be stable at any gain."
        )
    while kp_high / kp_low - 1.0 > tolerance and len(trials) < max_trials:
        kp = math.sqrt(kp_low * kp_high)
        found = measured(kp)
        if found.growth < SUSTAINED:
            kp_low, low = kp, found
        else:
            kp_high, high = kp, found
    periods = [x.period for x in (low, high) if math.isfinite(x.period)]
    if not periods:
        raise InputError(
            f"no oscillation was seen between kp = {kp_low:g} and {kp_high:g}; give a longer or finer response."
        )
    return CriticalGain(math.sqrt(kp_low * kp_high), float(np.mean(periods)), (kp_low, kp_high), tuple(trials))

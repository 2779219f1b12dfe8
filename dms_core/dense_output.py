"""Values between the steps of a run, from what was recorded at their ends.

Methods of order 2 take a cubic. Radau IIA's steps are ten times as long, and its own collocation polynomial is of order
3 only (Hairer and Wanner 1996, IV.8); the record holds more, namely accelerations that belong to q and v. So

* a second-order coordinate is the quintic through q, v, vdot at both ends (error h^6), v and vdot are its slopes (h^5,
  h^4);
* a first-order one is the cubic through q and its rate at both ends (h^4), as good as the collocation polynomial;
* multipliers are the cubic through four neighbouring steps, never across a jump of an input (h^4).
"""

from __future__ import annotations

import numpy as np

POINTS = 4
"""Steps through which multipliers are interpolated."""


def cubic(x, h, y0, y1, d0, d1):  # noqa: ANN001, ANN201
    """Cubic through values and slopes at both ends: value, first derivative, second derivative at x in [0, 1]."""
    e = y1 - y0
    b, c = 3.0 * e - h * (2.0 * d0 + d1), h * (d0 + d1) - 2.0 * e
    value = y0 + x * (h * d0 + x * (b + x * c))
    return value, d0 + x * (2.0 * b + 3.0 * x * c) / h, (2.0 * b + 6.0 * x * c) / (h * h)


def quintic(t, q, v, a, start, times, second):  # noqa: ANN001, ANN201
    """q, v, vdot at times between the recorded steps `start` and `start + 1`, shape (k, n_q) each.

    Args:
        t: recorded times [s], shape (n,).
        q: recorded coordinates, shape (n, n_q).
        v: recorded velocities.
        a: recorded accelerations.
        start: step at or before each time, shape (k,).
        times: [s], shape (k,).
        second: True for second-order coordinates, shape (n_q,).
    """
    end = start + 1
    h = (t[end] - t[start])[:, None]
    h = np.where(h > 0.0, h, 1.0)
    x = (times - t[start])[:, None] / h
    q0, q1, v0, v1, a0, a1 = q[start], q[end], h * v[start], h * v[end], h * h * a[start], h * h * a[end]
    # The polynomial q0 + v0 x + a0 x^2 / 2 + x^3 (c3 + c4 x + c5 x^2) in the unit step.
    e, s, b = q1 - q0 - v0 - 0.5 * a0, v1 - v0 - a0, a1 - a0
    c3, c4, c5 = 10.0 * e - 4.0 * s + 0.5 * b, -15.0 * e + 7.0 * s - b, 6.0 * e - 3.0 * s + 0.5 * b
    value = q0 + x * (v0 + x * (0.5 * a0 + x * (c3 + x * (c4 + x * c5))))
    slope = v0 + x * (a0 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
    bend = a0 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))
    first, first_slope, _ = cubic(x, h, q0, q1, v[start], v[end])
    q_at, v_at = np.where(second, value, first), np.where(second, slope / h, first_slope)
    return q_at, v_at, np.where(second, bend / (h * h), 0.0)


def neighbours(t: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Recorded steps around each interval `start`, all on its side of every jump, shape (POINTS, k).

    Where a piece between two jumps has fewer steps, the last ones stand several times.
    """
    pieces = np.concatenate([[0], np.cumsum(np.diff(t) == 0.0)])
    low = np.searchsorted(pieces, pieces[start], side="left")
    high = np.searchsorted(pieces, pieces[start], side="right") - 1
    first = np.clip(start - POINTS // 2 + 1, low, np.maximum(high - POINTS + 1, low))
    return np.minimum(first + np.arange(POINTS)[:, None], high)


def lagrange(t: np.ndarray, values: list[np.ndarray], around: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Polynomial through `values` at the steps `around`, repeated ones once, shape (k, ...).

    Args:
        t: recorded times [s].
        values: POINTS arrays of shape (k, m).
        around: their steps, shape (POINTS, k).
        times: [s], shape (k,).
    """
    nodes, total = t[around], np.zeros_like(values[0])
    fresh = np.concatenate([np.ones((1, around.shape[1]), bool), np.diff(around, axis=0) > 0])
    for j in range(POINTS):
        weight = fresh[j].astype(float)
        for k in range(POINTS):
            if k != j:
                apart = nodes[j] - nodes[k]
                use = fresh[k] & (apart != 0.0)
                weight = weight * np.where(use, (times - nodes[k]) / np.where(use, apart, 1.0), 1.0)
        total = total + weight[:, None] * values[j]
    return total

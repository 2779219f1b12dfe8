"""Values between the steps of a run, from what was recorded at their ends.

Methods of order 2 take a cubic. Radau IIA's steps are ten times as long, and its own collocation polynomial is of order
3 only (Hairer and Wanner 1996, IV.8); the record holds more, namely accelerations that belong to q and v. So

* a second-order coordinate is the quintic through q, v, vdot at both ends (error h^6), v and vdot are its slopes (h^5,
  h^4);
* a first-order one is the cubic through q and its rate at both ends (h^4), as good as the collocation polynomial;
* accelerations, rates of first-order coordinates and multipliers are those that satisfy the equations at these q and v
  (simulation/rates_between.py).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Rates = Callable[..., tuple[np.ndarray, np.ndarray, np.ndarray]]
"""v, vdot and lam of (model, signals, times, q, v, vdot, lam), where all but q are a guess."""


def cubic(x, h, y0, y1, d0, d1):  # noqa: ANN001, ANN201
    """Cubic through values and slopes at both ends: value, first derivative, second derivative at x in [0, 1]."""
    e = y1 - y0
    b, c = 3.0 * e - h * (2.0 * d0 + d1), h * (d0 + d1) - 2.0 * e
    value = y0 + x * (h * d0 + x * (b + x * c))
    return value, d0 + x * (2.0 * b + 3.0 * x * c) / h, (2.0 * b + 6.0 * x * c) / (h * h)


def quintic(x, h, ends, second):  # noqa: ANN001, ANN201
    """q, v, vdot within a step, each of shape (k, n_q).

    Args:
        x: place in the step, 0 to 1, shape (k, 1).
        h: size of the step [s], shape (k, 1).
        ends: q, v and vdot, each at both ends of the step, arrays of shape (k, n_q).
        second: True for second-order coordinates, shape (n_q,); others take the cubic.
    """
    (q0, q1), v, a = ends
    (v0, v1), (a0, a1) = (h * v[0], h * v[1]), (h * h * a[0], h * h * a[1])
    # The polynomial q0 + v0 x + a0 x^2 / 2 + x^3 (c3 + c4 x + c5 x^2) in the unit step.
    e, s, b = q1 - q0 - v0 - 0.5 * a0, v1 - v0 - a0, a1 - a0
    c3, c4, c5 = 10.0 * e - 4.0 * s + 0.5 * b, -15.0 * e + 7.0 * s - b, 6.0 * e - 3.0 * s + 0.5 * b
    value = q0 + x * (v0 + x * (0.5 * a0 + x * (c3 + x * (c4 + x * c5))))
    slope = v0 + x * (a0 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
    bend = a0 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))
    first, first_slope, _ = cubic(x, h, q0, q1, v[0], v[1])
    q_at, v_at = np.where(second, value, first), np.where(second, slope / h, first_slope)
    return q_at, v_at, np.where(second, bend / (h * h), 0.0)

"""The smallest activations that give wanted moments: a quadratic programme with bounds, solved in its dual.

    min  sum a_i^2 / 2 + |r|^2 / (2 e)     such that  F a + r = b,   low <= a <= high

Stationary where a = clip(F^T nu) and r = e nu (Karush, Kuhn and Tucker), so that nu solves piecewise linear equations

    F clip(F^T nu) + e nu = b

by Newton's method with a line search on the dual, which is concave. The remainder r is what no activation within the
bounds can give; e is so small that it is rounding otherwise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

MOST = 100
"""Newton iterations; each finds another set of activations at their bounds."""
REMAINDER = 1e-10
"""e over the largest |F|^2."""
SOLVED = 1e-12
"""Residual over the sizes of moments up to which nu solves its equations."""


class LeastActivations(NamedTuple):
    """What `least_activations` finds."""

    activations: np.ndarray
    """Shape (m,)."""
    shortage: np.ndarray
    """Moment that they do not give, b - F a, shape (d,)."""
    multipliers: np.ndarray
    """nu, shape (d,): d(sum a^2 / 2) / db."""


def least_activations(F: np.ndarray, b: np.ndarray, low: float, high: float) -> LeastActivations:
    """Activations of least squares.

    Args:
        F: moment of each muscle at full activation about each joint, shape (d, m).
        b: wanted moments, shape (d,).
        low: smallest activation.
        high: largest activation.
    """
    largest = float(np.max(np.sum(F * F, axis=1), initial=0.0)) or 1.0
    e, nu = REMAINDER * largest, np.zeros(len(b))
    size = float(np.abs(b).max(initial=0.0) + np.abs(F).sum(axis=1).max(initial=0.0) * high) or 1.0
    for _ in range(MOST):
        x = F.T @ nu
        a = np.clip(x, low, high)
        open_ = b - F @ a - e * nu
        if np.abs(open_).max(initial=0.0) < SOLVED * size:
            break
        inside = (x > low) & (x < high)
        H = (F[:, inside] @ F[:, inside].T) + e * np.eye(len(b))
        step = np.linalg.solve(H, open_)
        nu = nu + _length(F, b, e, nu, step, low, high) * step
    a = np.clip(F.T @ nu, low, high)
    return LeastActivations(a, b - F @ a, nu)


def _length(F: np.ndarray, b: np.ndarray, e: float, nu: np.ndarray, step: np.ndarray, low: float, high: float) -> float:
    """The length along a step where the dual is greatest: its slope, falling and piecewise linear, is 0 there."""
    base, along = F.T @ nu, F.T @ step

    def slope(length: float) -> float:
        return float(step @ (b - F @ np.clip(base + length * along, low, high) - e * (nu + length * step)))

    with np.errstate(divide="ignore", invalid="ignore"):
        kinks = np.concatenate([(low - base) / along, (high - base) / along])
    before = 0.0
    for kink in np.sort(kinks[np.isfinite(kinks) & (kinks > 0.0)]):
        if slope(float(kink)) <= 0.0:
            break
        before = float(kink)
    else:
        kink = before + 1.0
        while slope(float(kink)) > 0.0:
            kink = before + 2.0 * (kink - before)
    low_slope, high_slope = slope(before), slope(float(kink))
    if low_slope <= high_slope:
        return before or 1.0
    return before + (float(kink) - before) * low_slope / (low_slope - high_slope)

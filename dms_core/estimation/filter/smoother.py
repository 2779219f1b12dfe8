"""Rauch-Tung-Striebel smoother (Rauch, Tung and Striebel 1965): what a whole record tells of each time.

    G = Cov(x_k, x_k+1) P^-1,    x_k += G (x^s - x^p),    P_k += G (P^s - P^p) G^T

backwards, where x^p, P^p are those predicted for k + 1 and x^s, P^s the smoothed ones; differences are those of the
chart at k + 1, and each smoothed state lies on the constraints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.gaussian import symmetric
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.estimation.filter.steps import Step

ROUNDING = 1e-14
"""Eigenvalue of a scaled covariance below which a direction is known exactly."""


def smoothed(kalman: KalmanFilter, steps: Sequence[Step]) -> list[Belief]:
    """Smoothed beliefs of the steps of a filter; a stretch ends where the filter began anew."""
    found = [steps[-1].belief]
    for before, step in zip(reversed(steps[:-1]), reversed(steps[1:]), strict=True):
        found.append(before.belief if step.joint is None else _smoothed(kalman, before.belief, step, found[-1]))
    return found[::-1]


def _smoothed(kalman: KalmanFilter, filtered: Belief, step: Step, after: Belief) -> Belief:
    """The belief before a step, with what the step and all behind it tell."""
    predicted = step.predicted
    assert step.joint is not None
    G = step.joint @ _inverse(predicted.P)
    ahead = np.concatenate([predicted.chart.read(after.q, after.v), after.rest])
    x = filtered.mean + G @ (ahead - predicted.mean)
    P = symmetric(filtered.P + G @ (after.P - predicted.P) @ G.T)
    return kalman.here(kalman.within_bounds(replace(kalman.moved(filtered, x), P=P)))


def _inverse(P: np.ndarray) -> np.ndarray:
    """Inverse of a covariance; along directions that are known exactly it is 0."""
    scale = np.sqrt(np.maximum(np.diag(P), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(P / np.outer(scale, scale))
    kept = values > ROUNDING
    half = vectors[:, kept] / np.sqrt(values[kept])
    return (half @ half.T) / np.outer(scale, scale)

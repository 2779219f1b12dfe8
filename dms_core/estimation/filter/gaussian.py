"""Formulas of normal distributions that filters share: correction, truncation, smoothing gain."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from dms_core.estimation.filter.cut import cut_moments


class Corrected(NamedTuple):
    """A correction."""

    dx: np.ndarray
    P: np.ndarray
    nis: float
    """r^T S^-1 r, with as many degrees of freedom as readings where the filter is consistent."""


def symmetric(P: np.ndarray) -> np.ndarray:
    """The symmetric part."""
    return 0.5 * (P + P.T)


def gain(P: np.ndarray, C: np.ndarray, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """K = P C^T S^-1 and S = C P C^T + R."""
    S = symmetric(C @ P @ C.T + R)
    return la.solve(S, C @ P, assume_a="pos").T, S


def joseph(P: np.ndarray, K: np.ndarray, C: np.ndarray, R: np.ndarray) -> np.ndarray:
    """(1 - K C) P (1 - K C)^T + K R K^T, symmetric and positive whatever rounding does to K."""
    left = np.eye(len(P)) - K @ C
    return symmetric(left @ P @ left.T + K @ R @ K.T)


def corrected(P: np.ndarray, C: np.ndarray, R: np.ndarray, residual: np.ndarray) -> Corrected:
    """The correction by a residual r = y - h(x), in Joseph's form."""
    K, S = gain(P, C, R)
    return Corrected(K @ residual, joseph(P, K, C, R), float(residual @ la.solve(S, residual, assume_a="pos")))


def truncated(P: np.ndarray, k: int, mean: float, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Change of the mean and covariance where component k lies between two bounds (Simon and Simon 2010, sect. 2.4).

    The normal distribution of x_k is cut at the bounds; the mean and variance of what is left replace its own, and all
    else follows by its correlation.

    Args:
        P: covariance, shape (n, n).
        k: component.
        mean: of the component.
        low: least value, may be infinite.
        high: largest value, may be infinite.
    """
    deviation = math.sqrt(P[k, k])
    a, b = (low - mean) / deviation, (high - mean) / deviation
    shift, share = cut_moments(a, b)
    column = P[:, k] / P[k, k]
    return column * (shift * deviation), symmetric(P - np.outer(column, column) * P[k, k] * (1.0 - share))


def is_usable(P: np.ndarray) -> bool:
    """Whether a covariance is finite and positive definite but for rounding."""
    if not np.isfinite(P).all():
        return False
    scale = np.sqrt(np.maximum(np.diag(P), np.finfo(float).tiny))
    return bool(np.linalg.eigvalsh(P / np.outer(scale, scale))[0] > -1e-9)

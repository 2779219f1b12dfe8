"""Modes of a finite-element model for a modal body: Craig and Bampton's, made orthogonal and freed of rigid motions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg as la

from dms_core.errors import ModelError
from dms_core.model.flexible.modal.modal_data import STIFF


def orthogonal(mass: np.ndarray, stiffness: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """The modes within the span of some shapes that strain the body, of mass 1, softest first, shape (d, n).

    (Phi^T K Phi - w^2 Phi^T M Phi) a = 0; those with w = 0 are rigid motions and are left out. Shapes may depend on
    each other.

    Args:
        mass: M, shape (d, d).
        stiffness: K, shape (d, d).
        shapes: Phi, shape (d, m).
    """
    B = shapes.T @ mass @ shapes
    size = np.sqrt(np.diag(B))
    values, vectors = la.eigh(B / np.outer(size, size))
    kept = values > 1e-12 * values[-1]
    base = shapes @ (vectors[:, kept] / size[:, None] / np.sqrt(values[kept]))
    squares, a = la.eigh(base.T @ stiffness @ base)
    return (base @ a)[:, squares > STIFF * squares[-1]]


def craig_bampton(mass: np.ndarray, stiffness: np.ndarray, boundary: Sequence[int], inner_modes: int) -> np.ndarray:
    """Static modes of the boundary and the lowest modes within it while it is held, made orthogonal, shape (d, n).

    R. R. Craig and M. C. C. Bampton (1968), AIAA J. 6(7):1313-1319. The static modes of d_b boundary freedoms contain
    the six rigid motions of a free body, which `orthogonal` leaves out: n = d_b + inner_modes - 6.

    Args:
        mass: M, shape (d, d).
        stiffness: K, shape (d, d).
        boundary: degrees of freedom of the nodes to which joints attach.
        inner_modes: number of modes within.

    Raises:
        ModelError: the boundary is empty or out of range, or there are not as many modes within.
    """
    d, b = len(mass), np.unique(np.asarray(boundary, int))
    if len(b) == 0 or b[0] < 0 or b[-1] >= d:
        raise ModelError(f"boundary: Expected degrees of freedom from 0 to {d - 1}, got {list(boundary)}.")
    i = np.setdiff1d(np.arange(d), b)
    if not 0 <= inner_modes <= len(i):
        raise ModelError(f"inner_modes: Expected from 0 to {len(i)} modes, got {inner_modes}.")
    shapes = np.zeros((d, len(b) + inner_modes))
    shapes[b, np.arange(len(b))] = 1.0
    inner = stiffness[np.ix_(i, i)]
    shapes[np.ix_(i, np.arange(len(b)))] = -la.solve(inner, stiffness[np.ix_(i, b)], assume_a="sym")
    if inner_modes:
        found = la.eigh(inner, mass[np.ix_(i, i)], subset_by_index=(0, inner_modes - 1))[1]
        shapes[i, len(b) :] = found
    return orthogonal(mass, stiffness, shapes)

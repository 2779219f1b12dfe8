"""Redundant constraints (paper sect. 4): which rows of phi_q follow from the others, and multipliers made unique.

Dense methods of LAPACK (pivoted QR, singular values), meant for assembly and reports, not for every step; sparse ones
(sparse_rank.py) where phi_q is given as a sparse matrix.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from dms_core.errors import InputError
from dms_core.linear.sparse_rank import Normal, pivot_rows

RANK_TOLERANCE = 1e-9
"""Share of the largest singular value of the normalised rows; kinematic rows are exact to about 1e-14."""


SHIFT, REFINEMENTS = 1e-9, 4
"""Share of the largest singular value in minimum_norms; those down to 1e-3 of it are then treated to about 1e-12."""


class RowRank(NamedTuple):
    """What independent_rows finds."""

    independent: np.ndarray
    """Indices of a largest set of independent rows, ascending, shape (rank,)."""
    redundant: np.ndarray
    """The other rows, ascending, shape (m - rank,)."""
    singular_values: np.ndarray
    """Singular values of the rows scaled to length 1, descending, shape (min(m, n),); of a sparse matrix the largest
    and the smallest of the independent rows only, about."""
    combination: np.ndarray
    """C with G[redundant] = C G[independent], shape (m - rank, rank): what each redundant row follows from; of a sparse
    matrix (0, rank)."""


def _checked(G: np.ndarray) -> np.ndarray:
    """A finite matrix."""
    G = np.asarray(G, float)
    if G.ndim != 2 or not np.isfinite(G).all():
        raise InputError(f"G must be a finite matrix; its shape is {G.shape} and {np.sum(~np.isfinite(G))} are not.")
    return G


def independent_rows(G: np.ndarray | sp.csr_array, tol: float = RANK_TOLERANCE, least: int = 0) -> RowRank:
    """Rank of G and a set of independent rows.

    Rows are scaled to length 1, as metres and direction cosines mix. The rank is the number of singular values above
    tol times the largest. The set comes from QR with column pivoting of G^T (Golub and Van Loan 2013, sect. 5.4);
    weights that fall from 1 to 1/2 along the list make it prefer rows declared earlier, at no loss of safety.

    Args:
        G: matrix, shape (m, n); m = 0 and rows of zeros are allowed.
        tol: relative tolerance of the rank.
        least: rank that is known from elsewhere; as many rows are taken even where they are fewer by the tolerance.
    """
    if sp.issparse(G):
        return _sparse_rows(G, tol)
    G = _checked(G)
    m, n = G.shape
    if m == 0 or n == 0:
        none = np.zeros(0, int)
        return RowRank(none, np.arange(m), np.zeros(0), np.zeros((m, 0)))
    length, unit = np.linalg.norm(G, axis=1), _unit(G)
    values = la.svdvals(unit)
    rank = max(least, int(np.sum(values > tol * max(values[0], 1e-300))))
    weights = 1.0 - 0.5 * np.arange(m) / m
    order = la.qr((unit * weights[:, None]).T, mode="r", pivoting=True)[1]
    independent, redundant = np.sort(order[:rank]), np.sort(order[rank:])
    combination = np.zeros((redundant.size, rank))
    if redundant.size and rank:
        combination = la.lstsq(unit[independent].T, unit[redundant].T)[0].T
        combination *= length[redundant][:, None] / length[independent][None, :]
    return RowRank(independent, redundant, values, combination)


def _sparse_rows(G: sp.csr_array, tol: float) -> RowRank:
    """As independent_rows, of a sparse matrix with rows."""
    _checked(G.data[None])
    independent = pivot_rows(G, tol)
    largest, smallest, _ = Normal(G[independent]).extremes()
    redundant = np.setdiff1d(np.arange(G.shape[0]), independent)
    return RowRank(independent, redundant, np.array([largest, smallest]), np.zeros((0, len(independent))))


def least_norm(G: np.ndarray | sp.csr_array, b: np.ndarray) -> np.ndarray:
    """The shortest x with G x = b in the sense of least squares, or, of a sparse G, for b in its range; shape (n,)."""
    if not G.shape[0]:
        return np.zeros(G.shape[1])
    return Normal(G).least_norm(b) if sp.issparse(G) else np.linalg.lstsq(G, b, rcond=1e-10)[0]


def multipliers_of(G: np.ndarray | sp.csr_array, forces: np.ndarray) -> np.ndarray:
    """lam with G^T lam nearest to each of some forces, shapes (k, n) and (k, m), for independent rows G."""
    if sp.issparse(G):
        normal = Normal(G)
        return np.array([normal.multipliers(f) for f in forces])
    return np.linalg.lstsq(G.T, forces.T, rcond=1e-12)[0].T


def degenerate_rows(G: np.ndarray | sp.csr_array, rank: int) -> tuple[float, np.ndarray]:
    """The smallest singular value of rows that should be of this rank, and which rows share in losing it.

    Args:
        G: matrix, shape (m, n).
        rank: what it is elsewhere, from 1 to min(m, n).

    Returns:
        Singular value number `rank` of the rows scaled to length 1, and the size of each row's part in the left
        singular vectors of the values up to a hundred times that one, shape (m,).
    """
    if sp.issparse(G):
        _, smallest, left = Normal(G[pivot_rows(G, 0.0)] if rank < G.shape[0] else G).extremes()
        return smallest, np.abs(left)
    left, values, _ = la.svd(_unit(_checked(G)), full_matrices=False)
    small = np.flatnonzero(values[:rank] <= max(100.0 * values[rank - 1], RANK_TOLERANCE * values[0]))
    return float(values[rank - 1]), np.linalg.norm(left[:, small], axis=1)


def _unit(G: np.ndarray) -> np.ndarray:
    """Rows scaled to length 1; rows of zeros stay."""
    length = np.linalg.norm(G, axis=1)
    return G / np.where(length > 0.0, length, 1.0)[:, None]


def minimum_norms(G: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """The shortest multipliers with the same constraint forces G^T lam: lam* = G (G^T G)^+ G^T lam, for k matrices.

    With redundant constraints only G^T lam is determined by the motion. Of all lam with that force, lam* is the
    projection on the range of G. It shares the load among redundant rows as equal springs would, so that single
    reactions of a redundant joint are a convention (and depend on the units of the rows), while their sum is not.

    The pseudo-inverse is that of Tikhonov's regularisation with refinement: what the small shift spoils is a share
    SHIFT / sigma^2 of the part along a singular value sigma; each pass takes that share again.

    Args:
        G: phi_q, shape (k, m, n).
        lam: multipliers, shape (k, m).
    """
    k, m, n = G.shape
    transposed = np.swapaxes(G, 1, 2)
    normal = transposed @ G
    shift = SHIFT * np.trace(normal, axis1=1, axis2=2) / n
    normal[:, np.arange(n), np.arange(n)] += np.where(shift > 0.0, shift, 1.0)[:, None]
    best = np.zeros((k, m, 1))
    inverse = np.linalg.inv(normal)
    for _ in range(REFINEMENTS):
        best += G @ (inverse @ (transposed @ (lam[:, :, None] - best)))
    return best[:, :, 0]

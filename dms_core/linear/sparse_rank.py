"""Rank and least-norm solutions of large sparse phi_q, at a cost that grows with its entries, not with their cube.

The rank is the number of pivots of a Gaussian elimination with Markowitz' choice (markowitz.py) on rows of length
1: what is left below the tolerance in a row then follows from the rows before. Such pivots tell the rank less sharply
than singular values; both agree on rows that are redundant exactly, as those of joints are.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import SuperLU, splu

from dms_core.linear.markowitz import OUT_OF_ROOM, order

SHIFT = 1e-12
"""On the diagonal of G G^T, so that redundant rows leave it regular."""
REFINEMENTS = 4
"""Each takes what the shift spoiled down by SHIFT over the square of the smallest singular value."""
ITERATIONS = 12
"""Of the power methods for the largest and the smallest singular value: two digits are enough for a report."""


def unit_rows(G: sp.csr_array) -> sp.csr_array:
    """Rows scaled to length 1; rows of zeros stay."""
    length = np.sqrt(np.asarray((G * G).sum(axis=1)).ravel())
    return sp.csr_array(sp.diags_array(1.0 / np.where(length > 0.0, length, 1.0)) @ G)


def pivot_rows(G: sp.csr_array, tol: float) -> np.ndarray:
    """A largest set of independent rows, ascending, shape (rank,).

    Args:
        G: matrix, shape (m, n).
        tol: what is left in a row of length 1, relative to that, when it counts as zero.
    """
    G = unit_rows(G)
    G.sum_duplicates()
    n = max(G.shape)
    start = np.concatenate([G.indptr, np.full(n - G.shape[0], G.indptr[-1])]).astype(np.int64)
    index, data, room = G.indices.astype(np.int64), np.ascontiguousarray(G.data), 8 * G.nnz + 4 * n
    done = OUT_OF_ROOM
    while done == OUT_OF_ROOM:
        rows, _, done = order(n, start, index, data, np.arange(n), (n, n * n), 0.1, 0, room, tol)
        room *= 2
    return np.sort(rows[:done])


class Normal:
    """G G^T of rows scaled to length 1, factorised.

    Args:
        G: matrix, shape (m, n).
    """

    def __init__(self, G: sp.csr_array) -> None:
        self.G = unit_rows(G)
        self.length = np.sqrt(np.asarray((G * G).sum(axis=1)).ravel())
        product = sp.csc_array(self.G @ self.G.T + SHIFT * sp.eye_array(G.shape[0]))
        self.factors: SuperLU = splu(product, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0)

    def least_norm(self, b: np.ndarray) -> np.ndarray:
        """The shortest x with G x = b, for b in the range of G; shape (n,)."""
        scaled = b / np.where(self.length > 0.0, self.length, 1.0)
        x = np.zeros(self.G.shape[1])
        for _ in range(REFINEMENTS):
            x += self.G.T @ self.factors.solve(scaled - self.G @ x)
        return x

    def multipliers(self, force: np.ndarray) -> np.ndarray:
        """lam with G^T lam nearest to a force, shape (m,), for independent rows."""
        lam = np.zeros(self.G.shape[0])
        for _ in range(REFINEMENTS):
            lam += self.factors.solve(self.G @ (force - self.G.T @ lam))
        return lam / np.where(self.length > 0.0, self.length, 1.0)

    def extremes(self) -> tuple[float, float, np.ndarray]:
        """Largest and smallest singular value of the scaled rows, about, and the left vector of the smallest."""
        x = y = np.random.default_rng(0).normal(size=self.G.shape[0])
        for _ in range(ITERATIONS):
            x = self.G @ (self.G.T @ (x / np.linalg.norm(x)))
            y = self.factors.solve(y / np.linalg.norm(y))
        y /= np.linalg.norm(y)
        return float(np.sqrt(np.linalg.norm(x))), float(np.linalg.norm(self.G.T @ y)), y

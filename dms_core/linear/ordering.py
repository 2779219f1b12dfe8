"""Order of elimination: Markowitz counts with threshold pivoting on scaled values, done once for a pattern.

Among the entries that are large enough within their row of the remaining matrix,

    |a_ij| >= threshold * max_k |a_ik|,

the one with the least (r_i - 1)(c_j - 1) is eliminated next: r_i, c_j count the entries of its row and column, and the
product bounds the fill (Markowitz 1957, Management Science 3, 255; Duff, Erisman and Reid 2017, Direct Methods for
Sparse Matrices, ch. 7 and 10). Only a few of the shortest rows and columns are searched (Zlatev 1980). Rows and
columns are scaled to a largest entry of about 1 before (Ruiz 2001), as metres, radians and newtons share the matrix.

Markowitz' choice is local: on a long chain it eliminates everywhere at once and meets two-sided fronts in the end.
A `window` lets it choose freely only while a pivot costs little, then among the next unknowns along a
Cuthill-McKee sweep. Which is better depends on the model, so the caller tries some and keeps the cheapest.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from dms_core.errors import DmsError, InputError
from dms_core.linear.markowitz import OUT_OF_ROOM, SINGULAR, equilibrated, order


class SingularMatrixError(DmsError, ArithmeticError):
    """No full set of pivots exists. `rows` and `columns` are what is left over, in the caller's numbering."""

    def __init__(self, rows: np.ndarray, columns: np.ndarray) -> None:
        self.rows, self.columns = rows, columns
        super().__init__(
            "the matrix is singular: after everything else is eliminated only zeros or rounding are left in "
            f"row(s) {_shown(rows)} and column(s) {_shown(columns)}."
        )


def _shown(indices: np.ndarray) -> str:
    """The first few indices."""
    more = f" and {len(indices) - 8} more" if len(indices) > 8 else ""
    return ", ".join(str(i) for i in indices[:8]) + more


def markowitz(
    n: int,
    rows: np.ndarray,
    cols: np.ndarray,
    values: np.ndarray,
    *,
    threshold: float = 0.1,
    window: int = 0,
    free_cost: int = 0,
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Row and column permutation: step k eliminates the entry (row_perm[k], col_perm[k]).

    Args:
        n: number of unknowns.
        rows: row of each entry, shape (nnz,); repeated entries are summed.
        cols: column of each entry, shape (nnz,).
        values: numbers of a typical matrix, shape (nnz,); zeros keep their place in the pattern.
        threshold: smallest pivot relative to its row, 0 < threshold <= 1. Larger is safer and fills more.
        window: unknowns open to choice along the sweep; 0 lets Markowitz choose among all to the end.
        free_cost: with a window, pivots up to this Markowitz cost are taken first, wherever they are.
        seed: breaks ties between equal costs; the same seed gives the same order.

    Raises:
        InputError: a value that is not finite, or an index outside the matrix.
        SingularMatrixError: by structure or by value; names the rows and columns left over.
    """
    rows, cols, values = np.asarray(rows, np.int64), np.asarray(cols, np.int64), np.asarray(values, np.float64)
    _check(n, rows, cols, values, threshold)
    start, index, data = compressed(n, rows, cols, values)
    scaled = equilibrated(n, start, index, data)
    sweep = _sweep(n, start, index) if window else np.arange(n)
    room = 8 * index.size + 4 * n
    limits = (window or n, free_cost if window else n * n)
    row_perm, col_perm, done = order(n, start, index, scaled, sweep, limits, threshold, seed, room, SINGULAR)
    while done == OUT_OF_ROOM:
        room *= 2
        row_perm, col_perm, done = order(n, start, index, scaled, sweep, limits, threshold, seed, room, SINGULAR)
    if done < n:
        every = np.arange(n)
        raise SingularMatrixError(np.setdiff1d(every, row_perm[:done]), np.setdiff1d(every, col_perm[:done]))
    return row_perm, col_perm


def _check(n: int, rows: np.ndarray, cols: np.ndarray, values: np.ndarray, threshold: float) -> None:
    """Mistakes of the caller, named."""
    if not 0.0 < threshold <= 1.0:
        raise InputError(f"threshold = {threshold}: must lie in (0, 1]; 0.1 is usual.")
    if not rows.shape == cols.shape == values.shape:
        raise InputError(f"rows, cols, values have shapes {rows.shape}, {cols.shape}, {values.shape}; must be equal.")
    for name, x in (("rows", rows), ("cols", cols)):
        if x.size and not 0 <= x.min() <= x.max() < n:
            raise InputError(f"{name}: indices {x.min()} to {x.max()} do not fit a matrix of size {n}.")
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        e = wrong[0]
        raise InputError(f"values: the entry in row {rows[e]}, column {cols[e]} is {values[e]}; must be finite.")


def compressed(
    n: int, rows: np.ndarray, cols: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows one after the other, columns ascending, repeated entries summed: start (n+1,), index, data (nnz,)."""
    key, inverse = np.unique(rows.astype(np.int64) * n + cols, return_inverse=True)
    data = np.bincount(inverse.ravel(), weights=values, minlength=key.size)
    return np.searchsorted(key, np.arange(n + 1) * n), key % n, data


def _sweep(n: int, start: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Unknowns from one end of the structure to the other: reverse Cuthill-McKee on the pattern of A + A^T."""
    pattern = csr_matrix((np.ones(index.size), index, start), shape=(n, n))
    return reverse_cuthill_mckee((pattern + pattern.T).tocsr(), symmetric_mode=True).astype(np.int64)

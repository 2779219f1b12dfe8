"""The order of a solve that goes entry by entry.

A solve meets each number once, and waits for the sum of every block. Where blocks are sparse, the entries of L and U
stand for it one by one in a list of moves, sorted by how many moves each has to wait for, so that neighbours in the
list hardly ever wait for each other (level scheduling: Anderson and Saad 1989).
"""

from __future__ import annotations

import numpy as np

from dms_core.compiled.jit import compiled


def moves(n: int, start: np.ndarray, column: np.ndarray, diagonal: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
    """(number of moves of L, steps that are changed, steps that they are changed by): moves of L, then those of U."""
    row = np.repeat(np.arange(n), np.diff(start))
    down, up = _depths(n, start, column, diagonal)
    lower, upper = np.flatnonzero(column < row), np.flatnonzero(column > row)
    lower = lower[np.lexsort((row[lower], column[lower], down[column[lower]]))]
    upper = upper[np.lexsort((row[upper], -column[upper], up[column[upper]]))]
    order = np.concatenate([lower, upper])
    return lower.size, row[order], column[order]


@compiled(makes_arrays=True)
def _depths(n, start, column, diagonal):
    """Length of the longest chain of moves that a step waits for, in the solve with L and in that with U."""
    down, up = np.zeros(n, np.int64), np.zeros(n, np.int64)
    for i in range(n):
        for p in range(start[i], diagonal[i]):
            down[i] = max(down[i], down[column[p]] + 1)
    for r in range(n):
        i = n - 1 - r
        for p in range(diagonal[i] + 1, start[i + 1]):
            up[i] = max(up[i], up[column[p]] + 1)
    return down, up

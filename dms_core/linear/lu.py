"""Sparse LU of a fixed pattern, in place and without allocation: factor, solve, solve_transposed.

Right-looking elimination (Duff, Erisman and Reid 2017, ch. 10): step k divides the entries below its pivot by it and
subtracts multiples of its row from theirs. All targets are tabulated (symbolic.py), so that a factorisation is one
pass through a list of blocks of eight numbers. The storage array `a` holds the matrix before (zeroed, then
a[tables.position[e]] += value[e]), and after it L below and U right of the diagonal, with the inverse of each pivot in
its place; behind them, where blocks are sparse, the same numbers in the order in which a solve meets them. Everything
is compiled to be called from compiled code; the same input gives the same bits.

Numbers are real, or all arrays are complex; storage is then asked for twice as many reals, and seen as complex:
storage(2 * tables.size).view(complex).
"""

from __future__ import annotations

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.linear.lanes import WIDTH, dot, eliminate, subtract
from dms_core.linear.symbolic import LuTables

_U = np.uint64
_8 = np.uint64(WIDTH)
_32, _LOW = np.uint64(32), np.uint64(2**32 - 1)
_BLOCK = np.uint64(3)  # log2(WIDTH): from an offset to the number of its block


def storage(length: int, worlds: int | None = None) -> np.ndarray:
    """Zeros whose rows start at a cache line (64 bytes), shape (length,) or (worlds, length).

    Blocks that straddle two cache lines take twice the time. Rows of several worlds are kept apart by rounding the
    distance between them up to whole cache lines.
    """
    stride = -(-length // WIDTH) * WIDTH
    raw = np.zeros(stride * (worlds or 1) + WIDTH)
    begin = (-raw.ctypes.data // raw.itemsize) % WIDTH
    block = raw[begin : begin + stride * (worlds or 1)].reshape(-1, stride)[:, :length]
    return block[0] if worlds is None else block


@compiled
def _magnitude(x):
    """|x| of a real number, |Re x| + |Im x| of a complex one: within a factor of 1.5 of |x|, without its root."""
    return abs(x.real) + abs(x.imag)


@compiled(fastmath={"contract", "reassoc"})
def factor(tables, a, work):
    """Factors in place; returns (smallest relative pivot, its step).

    A pivot is measured against the sum of absolute values that its row held before the elimination: 1e-8 says that
    eight digits of that row have cancelled. 0 with the step of the first pivot that is zero or not finite means that
    the factorisation stopped there: row tables.row_of[step], column tables.col_of[step]. After new values have made
    the ratio much smaller than it was for the values of the order, order anew.

    Args:
        tables: LuTables of the pattern.
        a: matrix in, factors out, shape (tables.size,).
        work: overwritten, shape (tables.work_size,).
    """
    for k in range(tables.n):
        total = 0.0
        for p in range(tables.first[k], tables.end[k]):
            total += _magnitude(a[p])
        work[k] = total
    smallest, where, t = np.inf, -1, _U(0)
    for k in range(tables.n):
        diagonal, lane, end = _U(tables.diagonal[k]), _U(tables.lane[k]), _U(tables.end[k])
        pivot = a[diagonal + lane]
        ratio = _magnitude(pivot) / work[k].real
        if not ratio >= smallest:
            if not 0.0 < ratio < np.inf:
                return 0.0, k
            smallest, where = ratio, k
        inverse = 1.0 / pivot
        a[diagonal + lane] = inverse
        for _ in range(tables.below[k]):
            row = _U(tables.target[t])
            t += _U(1)
            multiplier = a[row + lane] * inverse
            eliminate(a, row, diagonal, lane, multiplier)
            for block in range(diagonal + _8, end, _8):
                subtract(a, _U(tables.target[t]), a, block, multiplier)
                t += _U(1)
    if tables.move.shape[0] > 0:
        _line_up(tables, a)
    return smallest, where


@compiled(forceinline=True)
def _line_up(tables, a):
    """Put behind the blocks: entries of L, entries of U over the pivot of their row, inverse pivots."""
    numbers, moves = _U(tables.numbers), tables.move.shape[0]
    pivots = numbers + _U(moves)
    for k in range(tables.n):
        a[pivots + _U(k)] = a[_U(tables.diagonal[k]) + _U(tables.lane[k])]
    for e in range(tables.lower):
        a[numbers + _U(e)] = a[tables.place[e]]
    for e in range(tables.lower, moves):
        a[numbers + _U(e)] = a[tables.place[e]] * a[pivots + (_U(tables.move[e]) >> _32)]


@compiled(fastmath={"contract"}, forceinline=True)
def _solve_by_moves(tables, a, b, x, work):
    """As solve, one entry of L and U after the other."""
    numbers, moves = _U(tables.numbers), tables.move.shape[0]
    pivots = numbers + _U(moves)
    for k in range(tables.n):
        work[k] = b[tables.row_of[k]]
    for e in range(tables.lower):
        move = _U(tables.move[e])
        work[move >> _32] -= a[numbers + _U(e)] * work[move & _LOW]
    for k in range(tables.n):
        work[k] *= a[pivots + _U(k)]
    for e in range(tables.lower, moves):
        move = _U(tables.move[e])
        work[move >> _32] -= a[numbers + _U(e)] * work[move & _LOW]
    for k in range(tables.n):
        x[tables.col_of[k]] = work[k]


@compiled(fastmath={"contract"}, forceinline=True)
def _solve_by_blocks(tables, a, b, x, work):
    """As solve, row by row."""
    n = tables.n
    work[:] = 0.0
    for k in range(n):
        slot, diagonal, lane = _U(tables.slot[k]), _U(tables.diagonal[k]), _U(tables.lane[k])
        y, column = b[tables.row_of[k]], slot - lane
        for p in range(_U(tables.first[k]), diagonal, _8):
            y -= dot(a, p, work, _U(tables.group[p >> _BLOCK]))
        for m in range(lane):
            y -= a[diagonal + m] * work[column + m]
        work[slot] = y
    for r in range(n):
        k = n - 1 - r
        slot, diagonal, lane = _U(tables.slot[k]), _U(tables.diagonal[k]), _U(tables.lane[k])
        y, column = work[slot], slot - lane
        for p in range(diagonal + _8, _U(tables.end[k]), _8):
            y -= dot(a, p, work, _U(tables.group[p >> _BLOCK]))
        for m in range(lane + _U(1), _8):
            y -= a[diagonal + m] * work[column + m]
        y *= a[diagonal + lane]
        work[slot] = y
        x[tables.col_of[k]] = y


@compiled
def solve(tables, a, b, x, work):
    """x of A x = b from the factors in a; b and x may be the same array.

    Args:
        tables: LuTables of the pattern.
        a: factors, shape (tables.size,).
        b: right-hand side, shape (n,).
        x: solution, shape (n,).
        work: overwritten, shape (tables.work_size,).
    """
    if tables.move.shape[0] > 0:
        _solve_by_moves(tables, a, b, x, work)
    else:
        _solve_by_blocks(tables, a, b, x, work)


@compiled(fastmath={"contract"})
def solve_transposed(tables, a, b, x, work):
    """x of A^T x = b from the factors of A in a; arguments as in solve."""
    n = tables.n
    work[:] = 0.0
    for k in range(n):
        work[tables.slot[k]] = b[tables.col_of[k]]
    for k in range(n):
        slot, diagonal, lane = _U(tables.slot[k]), _U(tables.diagonal[k]), _U(tables.lane[k])
        y, column = work[slot] * a[diagonal + lane], slot - lane
        work[slot] = y
        for m in range(lane + _U(1), _8):
            work[column + m] -= a[diagonal + m] * y
        for p in range(diagonal + _8, _U(tables.end[k]), _8):
            subtract(work, _U(tables.group[p >> _BLOCK]), a, p, y)
    for r in range(n):
        k = n - 1 - r
        slot, diagonal, lane = _U(tables.slot[k]), _U(tables.diagonal[k]), _U(tables.lane[k])
        y, column = work[slot], slot - lane
        x[tables.row_of[k]] = y
        for m in range(lane):
            work[column + m] -= a[diagonal + m] * y
        for p in range(_U(tables.first[k]), diagonal, _8):
            subtract(work, _U(tables.group[p >> _BLOCK]), a, p, y)


@compiled
def assemble(tables, values, a):
    """Writes a matrix given as entries, in the order of tables.position, into the storage array a."""
    a[:] = 0.0
    for e in range(values.size):
        a[tables.position[e]] += values[e]


__all__ = ["LuTables", "assemble", "factor", "solve", "solve_transposed", "storage"]

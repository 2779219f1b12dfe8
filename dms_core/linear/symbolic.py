"""Everything about a factorisation that does not depend on numbers: fill, blocks, and where each number goes.

Rows of L + U are stored in blocks of eight neighbouring columns (in order of elimination), one cache line each: a
processor adds a multiple of a block to another in one step, so zeros inside a block cost nothing and scattered
columns cost dearly. Two freedoms are used to have few blocks:

- steps that do not touch each other may be exchanged without any change of the fill: each is put right after the
  last step that it depends on (depth first through the graph of L and U);
- a block may end early: the borders that cost least are found exactly, by dynamic programming.

A solve meets each number once, and waits for the sum of every block. Where blocks are sparse, the entries of L and U
stand for it one by one in a list of moves, sorted by how many moves each has to wait for, so that neighbours in the
list hardly ever wait for each other (level scheduling: Anderson and Saad 1989).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.errors import InputError
from dms_core.linear.lanes import WIDTH
from dms_core.linear.ordering import SingularMatrixError, compressed, markowitz

BLOCK_COST, GROUP_COST = 1.0, 3.0
"""Cost of one stored block (a load in each solve) and one group of columns, in block updates of the factorisation."""


SPARSE = 3.5
"""Entries of L + U a block up to which a solve goes entry by entry; at 4 both ways take the same time."""


class LuTables(NamedTuple):
    """Constant tables of one pattern. The step k eliminates entry (row_of[k], col_of[k]) of the caller's matrix.

    Offsets point into the storage array `a`; `slot` is a step's place in a vector padded to whole blocks.
    """

    n: int
    """Unknowns."""
    size: int
    """Length of the storage array a: blocks, numbers of the moves, and a last block of eight, which is a waste bin for
    numbers that are to be dropped."""
    work_size: int
    """Length of the work array of factor and of the solves."""
    updates: int
    """Block updates of one factorisation: its cost."""
    fill: int
    """Non-zeros of L + U (the diagonal once)."""
    multiply_adds: int
    """Multiplications and additions of one factorisation, without those on zeros inside blocks."""
    position: np.ndarray
    """Where in `a` each entry of the input goes, shape (nnz,), int32; repeated entries share a place."""
    row_of: np.ndarray
    col_of: np.ndarray
    slot: np.ndarray
    lane: np.ndarray
    """slot modulo 8, shape (n,)."""
    first: np.ndarray
    diagonal: np.ndarray
    end: np.ndarray
    """Offsets of a row's first block, the block of its pivot, and beyond its last, shape (n,)."""
    group: np.ndarray
    """First slot of each stored block's columns, shape (blocks,)."""
    below: np.ndarray
    """Entries of L below each pivot, shape (n,)."""
    target: np.ndarray
    """Offsets of the blocks that are updated, in order: by step, by row of L, by block of U, shape (updates,)."""
    lower: int
    """Number of moves of L; those of U follow. There are none where a solve goes by blocks."""
    numbers: int
    """Offset of the numbers of all moves, which factor puts behind the blocks, then of the inverse pivots."""
    move: np.ndarray
    """(step that is changed) 2^32 + (step that it is changed by) of each move, int64, shape (fill - n,) or (0,)."""
    place: np.ndarray
    """Offset of each move's entry in the blocks."""


class Fill(NamedTuple):
    """Pattern of L + U by rows, columns ascending, and of L by columns."""

    start: np.ndarray
    column: np.ndarray
    diagonal: np.ndarray
    below_start: np.ndarray
    below: np.ndarray


def plan(
    n: int, rows: np.ndarray, cols: np.ndarray, values: np.ndarray, *, threshold: float = 0.1, quick: bool = False
) -> LuTables:
    """Tries several orders of elimination and keeps the one whose factorisation takes the fewest steps.

    Args:
        n: number of unknowns.
        rows: row of each entry, shape (nnz,).
        cols: column of each entry.
        values: entries of a typical matrix; zeros keep their place in the pattern.
        threshold: smallest pivot relative to its row, see ordering.markowitz.
        quick: takes the first order, for a matrix that will not be factorised often in it.

    Raises:
        SingularMatrixError: names the rows and columns that are left over.
    """
    best: tuple = ()
    least = np.inf
    seeds = 1 if quick else int(np.clip(100_000 // max(len(rows), 1), 1, 6))
    for window, free_cost in ((0, 0),) if quick else ((0, 0), (80, 60), (20, 60)):
        for seed in range(seeds):
            order = markowitz(n, rows, cols, values, threshold=threshold, window=window, free_cost=free_cost, seed=seed)
            arranged = _arranged(n, rows, cols, *order)
            if arranged[-1] < least:
                best, least = arranged, arranged[-1]
    return _tables(n, rows, cols, *best[:-1])


def symbolic(n: int, rows: np.ndarray, cols: np.ndarray, row_perm: np.ndarray, col_perm: np.ndarray) -> LuTables:
    """Tables of a pattern and a given order of elimination; exchangeable steps may be exchanged.

    Args:
        n: number of unknowns.
        rows: row of each entry of the pattern, shape (nnz,).
        cols: column of each entry.
        row_perm: step k eliminates entry (row_perm[k], col_perm[k]), shape (n,).
        col_perm: see row_perm.

    Raises:
        InputError: the order is no permutation.
        SingularMatrixError: a pivot is not in the pattern of L + U.
    """
    for name, perm in (("row_perm", row_perm), ("col_perm", col_perm)):
        if not np.array_equal(np.sort(perm), np.arange(n)):
            raise InputError(f"{name} is no permutation of 0 to {n - 1}.")
    return _tables(n, rows, cols, *_arranged(n, rows, cols, row_perm, col_perm)[:-1])


def _arranged(n, rows, cols, row_perm, col_perm):
    """The better of the given order and its depth-first equal: (row_perm, col_perm, fill, leading columns, cost)."""
    fill = _fill(n, rows, cols, row_perm, col_perm)
    leading, cost = _groups(n, fill, BLOCK_COST, GROUP_COST)
    order = _depth_first(n, fill)
    moved = (row_perm[order], col_perm[order])
    moved_fill = _fill(n, rows, cols, *moved)
    moved_leading, moved_cost = _groups(n, moved_fill, BLOCK_COST, GROUP_COST)
    if moved_cost < cost:
        return (*moved, moved_fill, moved_leading, moved_cost)
    return row_perm, col_perm, fill, leading, cost


def _inverse(perm: np.ndarray) -> np.ndarray:
    """The step at which each row or column is eliminated."""
    step = np.empty(perm.size, np.int64)
    step[perm] = np.arange(perm.size)
    return step


def _fill(n, rows, cols, row_perm, col_perm) -> Fill:
    """Pattern of L + U of the permuted matrix."""
    start, index, _ = compressed(n, _inverse(row_perm)[rows], _inverse(col_perm)[cols], np.zeros(len(rows)))
    room = 8 * index.size
    filled = _filled(n, start, index, room)
    while filled[3] < 0:
        room *= 2
        filled = _filled(n, start, index, room)
    start, index, diagonal, used = filled
    missing = np.flatnonzero(diagonal < 0)[:1]
    if missing.size:
        raise SingularMatrixError(np.asarray(row_perm)[missing], np.asarray(col_perm)[missing])
    index = index[:used].copy()
    return Fill(start, index, diagonal, *_below(n, start, index, diagonal))


@compiled(makes_arrays=True)
def _filled(n, start, index, room):
    """Row i of L + U is row i of the matrix joined with row k of U for every k of its part in L, in ascending order.

    The row under construction is a sorted linked list whose head and end are n. Returns start, index, place of the
    diagonal (-1 where it is missing) and the length used (-1: call again with more room).
    """
    out, begin, diagonal = np.empty(room, np.int64), np.zeros(n + 1, np.int64), np.full(n, -1)
    following, seen, used = np.empty(n + 1, np.int64), np.full(n, -1), 0
    for i in range(n):
        last = n
        for p in range(start[i], start[i + 1]):
            seen[index[p]] = i
            following[last] = index[p]
            last = index[p]
        following[last] = n
        k = following[n]
        while k < i:
            at = k
            for p in range(diagonal[k] + 1, begin[k + 1]):
                j = out[p]
                if seen[j] != i:
                    seen[j] = i
                    while following[at] < j:
                        at = following[at]
                    following[j], following[at] = following[at], j
            k = following[k]
        k = following[n]
        while k < n:
            if used == room:
                return begin, out, diagonal, -1
            if k == i:
                diagonal[i] = used
            out[used] = k
            used, k = used + 1, following[k]
        begin[i + 1] = used
        if diagonal[i] < 0:
            # No pivot in this row: later rows could not use it; the caller raises.
            return begin, out, diagonal, used
    return begin, out, diagonal, used


@compiled(makes_arrays=True)
def _below(n, start, index, diagonal):
    """Rows of L by columns: start (n+1,), rows ascending."""
    begin = np.zeros(n + 1, np.int64)
    for i in range(n):
        for p in range(start[i], diagonal[i]):
            begin[index[p] + 1] += 1
    for i in range(n):
        begin[i + 1] += begin[i]
    rows, free = np.empty(begin[n], np.int64), begin.copy()
    for i in range(n):
        for p in range(start[i], diagonal[i]):
            rows[free[index[p]]] = i
            free[index[p]] += 1
    return begin, rows


@compiled(makes_arrays=True)
def _depth_first(n, fill):
    """The steps in an order that respects L and U and takes up at once what a step has made ready."""
    waits = np.zeros(n, np.int64)
    for k in range(n):
        for p in range(fill.diagonal[k] + 1, fill.start[k + 1]):
            waits[fill.column[p]] += 1
        for p in range(fill.below_start[k], fill.below_start[k + 1]):
            waits[fill.below[p]] += 1
    stack, order, top = np.empty(n, np.int64), np.empty(n, np.int64), 0
    for k in range(n - 1, -1, -1):
        if waits[k] == 0:
            stack[top] = k
            top += 1
    for m in range(n):
        top -= 1
        k = stack[top]
        order[m], bottom = k, top
        for p in range(fill.diagonal[k] + 1, fill.start[k + 1]):
            top = _release(fill.column[p], waits, stack, top)
        for p in range(fill.below_start[k], fill.below_start[k + 1]):
            top = _release(fill.below[p], waits, stack, top)
        _sort_descending(stack, bottom, top)
    return order


@compiled
def _sort_descending(x, begin, end):
    """Sort x[begin:end], a few numbers, by insertion: numpy's sort takes seconds to compile."""
    for i in range(begin + 1, end):
        value, k = x[i], i
        while k > begin and x[k - 1] < value:
            x[k] = x[k - 1]
            k -= 1
        x[k] = value


@compiled(makes_arrays=True)
def _release(k, waits, stack, top):
    """One less to wait for; a step that waits for nothing goes on the stack."""
    waits[k] -= 1
    if waits[k] == 0:
        stack[top] = k
        top += 1
    return top


@compiled(makes_arrays=True)
def _groups(n, fill, block_cost, group_cost):
    """Where a new group of at most eight columns starts (bool, (n,)), and the cost of the whole.

    An entry opens a block in its row when the row's next entry lies outside the group: saved[s, m] sums the cost of
    the rows that hold column s and have no further entry in a group of length m that begins at s.
    """
    saved = np.zeros((n, WIDTH + 2))
    for k in range(n):
        below = fill.below_start[k + 1] - fill.below_start[k]
        for p in range(fill.start[k], fill.start[k + 1]):
            gap = WIDTH + 1
            if p + 1 < fill.start[k + 1]:
                gap = min(gap, fill.column[p + 1] - fill.column[p])
            saved[fill.column[p], gap] += block_cost + (below if p >= fill.diagonal[k] else 0)
    best, previous = np.full(n + 1, np.inf), np.zeros(n + 1, np.int64)
    best[0] = 0.0
    for s in range(n):
        for m in range(WIDTH, 0, -1):
            saved[s, m] += saved[s, m + 1]
    for e in range(1, n + 1):
        cost = group_cost
        for s in range(e - 1, max(-1, e - 1 - WIDTH), -1):
            cost += saved[s, e - s]
            if best[s] + cost < best[e]:
                best[e], previous[e] = best[s] + cost, s
    leading, e = np.zeros(n, np.bool_), n
    while e > 0:
        e = previous[e]
        leading[e] = True
    return leading, best[n]


def _tables(n, rows, cols, row_perm, col_perm, fill: Fill, leading: np.ndarray) -> LuTables:
    """Blocks, targets and positions from the pattern."""
    first_of_group = np.maximum.accumulate(np.where(leading, np.arange(n), 0))
    lane = np.arange(n) - first_of_group
    slot = (np.cumsum(leading) - 1) * WIDTH + lane
    first, diagonal, end, group = _blocks(n, fill, slot)
    below = np.diff(fill.below_start)
    target = _targets(n, fill, first, diagonal, end, group, int((below * (end - diagonal)).sum()) // WIDTH)
    right = fill.start[1:] - fill.diagonal
    position = _positions(_inverse(row_perm)[rows], _inverse(col_perm)[cols], slot, first, group)
    lower, goal, source = _moves(n, fill) if fill.column.size <= SPARSE * group.size else NO_MOVES
    place = _positions(goal, source, slot, first, group)
    numbers = group.size * WIDTH
    # Unsigned indices spare the compiled loops numba's test for negative ones.
    tables = (slot, lane, first, diagonal, end, group, below, target)
    slot, lane, first, diagonal, end, group, below, target = (x.astype(np.uint32) for x in tables)
    return LuTables(
        n,
        -(-(numbers + (place.size + n if place.size else 0)) // WIDTH) * WIDTH + WIDTH,
        int(leading.sum()) * WIDTH,
        target.size,
        fill.column.size,
        int((below * right).sum()),
        position,
        np.asarray(row_perm).astype(np.uint32),
        np.asarray(col_perm).astype(np.uint32),
        slot,
        lane,
        first,
        diagonal,
        end,
        group,
        below,
        target,
        lower,
        numbers,
        goal << 32 | source,
        place.astype(np.uint32),
    )


NO_MOVES = 0, np.zeros(0, np.int64), np.zeros(0, np.int64)


def _moves(n, fill: Fill) -> tuple[int, np.ndarray, np.ndarray]:
    """(number of moves of L, steps that are changed, steps that they are changed by): moves of L, then those of U."""
    row, column = np.repeat(np.arange(n), np.diff(fill.start)), fill.column
    down, up = _depths(n, fill.start, column, fill.diagonal)
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


@compiled(makes_arrays=True)
def _blocks(n, fill, slot):
    """Offsets of each row's first block, pivot's block and end, and the first slot of every block."""
    first, diagonal, end = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    group, count = np.empty(fill.column.size, np.int64), 0
    for k in range(n):
        first[k] = count * WIDTH
        for p in range(fill.start[k], fill.start[k + 1]):
            g = slot[fill.column[p]] // WIDTH * WIDTH
            if count * WIDTH == first[k] or group[count - 1] != g:
                group[count] = g
                count += 1
            if p == fill.diagonal[k]:
                diagonal[k] = (count - 1) * WIDTH
        end[k] = count * WIDTH
    return first, diagonal, end, group[:count].copy()


@compiled(makes_arrays=True)
def _targets(n, fill, first, diagonal, end, group, updates):
    """For every step, every row below the pivot and every block of the pivot row: which block is updated."""
    target, count = np.empty(updates, np.int64), 0
    for k in range(n):
        for p in range(fill.below_start[k], fill.below_start[k + 1]):
            b = first[fill.below[p]] // WIDTH
            for m in range(diagonal[k] // WIDTH, end[k] // WIDTH):
                while group[b] != group[m]:
                    b += 1
                target[count] = b * WIDTH
                count += 1
    return target


@compiled(makes_arrays=True)
def _positions(row_steps, col_steps, slot, first, group):
    """Where each entry of the input is stored."""
    out = np.empty(row_steps.size, np.int32)
    for e in range(row_steps.size):
        s, b = slot[col_steps[e]], first[row_steps[e]] // WIDTH
        while group[b] != s // WIDTH * WIDTH:
            b += 1
        out[e] = b * WIDTH + s % WIDTH
    return out

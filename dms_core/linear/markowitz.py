"""The compiled half of ordering.py: numeric elimination in the order of least Markowitz cost.

Rows hold columns and values, columns hold rows only; a line that outgrows its room moves to the end of the store.
Lines that may give a pivot hang in doubly linked lists, one list for each number of entries, so that the shortest are
found at once.
"""

from typing import NamedTuple

import numpy as np

from dms_core.compiled.jit import compiled

SEARCHED = 8
"""Rows and columns with admissible entries that are looked at for one pivot."""
SINGULAR = 1e-13
"""A remaining row below this (the scaled matrix has largest entries 1) is rounding, not information."""
OUT_OF_ROOM = -1
"""Returned in place of the number of pivots: call again with more room."""


class Lines(NamedTuple):
    """All rows, or all columns, of the remaining matrix."""

    first: np.ndarray
    length: np.ndarray
    room: np.ndarray
    store: np.ndarray
    used: np.ndarray
    head: np.ndarray
    after: np.ndarray
    before: np.ndarray
    listed: np.ndarray
    done: np.ndarray


@compiled(makes_arrays=True)
def equilibrated(n, start, index, data):
    """A copy of data with largest entries near 1 in all lines (Ruiz 2001: each pass halves the digits of spread)."""
    x = np.abs(data)
    for _ in range(5):
        row, col = np.zeros(n), np.zeros(n)
        for i in range(n):
            for p in range(start[i], start[i + 1]):
                row[i] = max(row[i], x[p])
                col[index[p]] = max(col[index[p]], x[p])
        for i in range(n):
            for p in range(start[i], start[i + 1]):
                if x[p] > 0.0:
                    x[p] /= np.sqrt(row[i]) * np.sqrt(col[index[p]])
    return np.copysign(x, data)


@compiled(makes_arrays=True)
def _lines(n, start, index, room, by_column):
    """Rows, or columns, of a compressed matrix with room to grow; none is listed yet."""
    length = np.zeros(n, np.int64)
    for i in range(n):
        for p in range(start[i], start[i + 1]):
            length[index[p] if by_column else i] += 1
    first = np.zeros(n, np.int64)
    for j in range(1, n):
        first[j] = first[j - 1] + length[j - 1]
    fill, store = first.copy(), np.empty(room, np.int64)
    for i in range(n):
        for p in range(start[i], start[i + 1]):
            line, other = (index[p], i) if by_column else (i, index[p])
            store[fill[line]] = other
            fill[line] += 1
    return Lines(
        first, length, length.copy(), store, np.array([index.size]), np.full(n + 1, -1), np.full(n, -1),
        np.full(n, -1), np.zeros(n, np.bool_), np.zeros(n, np.bool_),
    )  # fmt: skip


@compiled(makes_arrays=True)
def _enlist(X, line):
    """Puts an open line first in the list of its length."""
    first = X.head[X.length[line]]
    X.after[line], X.before[line] = first, -1
    if first >= 0:
        X.before[first] = line
    X.head[X.length[line]] = line


@compiled(makes_arrays=True)
def _delist(X, line):
    """Takes an open line out of the list of its length."""
    after, before = X.after[line], X.before[line]
    if before >= 0:
        X.after[before] = after
    else:
        X.head[X.length[line]] = after
    if after >= 0:
        X.before[after] = before


@compiled(makes_arrays=True)
def _open(X, line):
    """Makes a line a candidate, unless its pivot is already taken."""
    if not X.done[line] and not X.listed[line]:
        X.listed[line] = True
        _enlist(X, line)


@compiled(makes_arrays=True)
def _close_all(X):
    """No line is a candidate any more."""
    X.head[:] = -1
    X.listed[:] = False


@compiled(makes_arrays=True)
def _make_room(X, values, line, wanted):
    """Make room for `wanted` entries in a line; values has entries only for rows. False when the store is full."""
    if wanted <= X.room[line]:
        return True
    new, size = X.used[0], 2 * wanted
    if new + size > X.store.size:
        return False
    old = X.first[line]
    for k in range(X.length[line]):
        X.store[new + k] = X.store[old + k]
        if values.size > 0:
            values[new + k] = values[old + k]
    X.first[line], X.room[line], X.used[0] = new, size, new + size
    return True


@compiled(makes_arrays=True)
def _place_of(X, line, other):
    """Where in the store a line holds `other`."""
    p = X.first[line]
    while X.store[p] != other:
        p += 1
    return p


@compiled(makes_arrays=True)
def _search_line(R, C, values, largest, threshold, floor, line, is_column, best, state):
    """Improves best = (cost, key, i, j) by the admissible entries of one line; also whether it had one that counts."""
    cost, key, bi, bj = best
    found = False
    X = C if is_column else R
    for p in range(X.first[line], X.first[line] + X.length[line]):
        i, j = (X.store[p], line) if is_column else (line, X.store[p])
        c = (R.length[i] - 1) * (C.length[j] - 1)
        if c > cost or largest[i] <= floor:
            continue
        x = abs(values[_place_of(R, i, j) if is_column else p])
        if x >= threshold * largest[i]:
            found = True
            state = (state * 1103515245 + 12345) % 2147483648
            if c < cost or state > key:
                cost, key, bi, bj = c, state, i, j
    return (cost, key, bi, bj), found, state


@compiled(makes_arrays=True)
def _find_pivot(n, R, C, values, largest, threshold, floor, state):
    """The cheapest admissible entry of the shortest open lines: cost, row (-1 when there is none), column, state.

    A line of r entries costs at least (r - 1)^2 when all shorter lines, and r (r - 1) when also the columns of r
    entries, have been searched: beyond that nothing better can come.
    """
    best, seen = (n * n, -1, -1, -1), 0
    for count in range(1, n + 1):
        for side in range(2):
            X = R if side else C
            line = X.head[count]
            while line >= 0 and seen < SEARCHED:
                best, found, state = _search_line(R, C, values, largest, threshold, floor, line, side == 0, best, state)
                seen += found
                line = X.after[line]
            if best[2] >= 0 and (seen >= SEARCHED or best[0] <= count * (count - 1 + side)):
                return best[0], best[2], best[3], state
    return best[0], best[2], best[3], state


@compiled(makes_arrays=True)
def _take_out(R, C, values, place, pi, pj):
    """Removes the pivot row from the columns, marks where it holds each column, returns the pivot."""
    pivot = 0.0
    p0 = R.first[pi]
    for p in range(p0, p0 + R.length[pi]):
        j = R.store[p]
        if C.listed[j]:
            _delist(C, j)
        t = _place_of(C, j, pi)
        C.length[j] -= 1
        C.store[t] = C.store[C.first[j] + C.length[j]]
        place[j] = p - p0
        if j == pj:
            pivot = values[p]
    place[pj] = -1
    return pivot


@compiled(makes_arrays=True)
def _update_row(R, C, values, largest, place, i, pi, pj, pivot):
    """Row i loses column pj and gains the fill of the pivot row. False when the store is full."""
    if not _make_room(R, values, i, R.length[i] + R.length[pi]):
        return False
    t = _place_of(R, i, pj)
    factor = values[t] / pivot
    p0, last, top = R.first[pi], R.first[i] + R.length[i] - 1, 0.0
    R.store[t], values[t] = R.store[last], values[last]
    for s in range(R.first[i], last):
        j = R.store[s]
        if place[j] >= 0:
            values[s] -= factor * values[p0 + place[j]]
            place[j] = -2 - place[j]
        top = max(top, abs(values[s]))
    for p in range(p0, p0 + R.length[pi]):
        j = R.store[p]
        if place[j] < -1:
            place[j] = -2 - place[j]
        elif j != pj:
            if not _make_room(C, values[:0], j, C.length[j] + 1):
                return False
            R.store[last], values[last] = j, -factor * values[p]
            top, last = max(top, abs(values[last])), last + 1
            C.store[C.first[j] + C.length[j]] = i
            C.length[j] += 1
    R.length[i], largest[i] = last - R.first[i], top
    return True


@compiled(makes_arrays=True)
def _eliminate(R, C, values, largest, place, pi, pj):
    """One step of Gauss' elimination on the pivot (pi, pj). False when a store is full."""
    if R.listed[pi]:
        _delist(R, pi)
    R.listed[pi], R.done[pi] = False, True
    pivot = _take_out(R, C, values, place, pi, pj)
    C.listed[pj], C.done[pj] = False, True
    for t in range(C.first[pj], C.first[pj] + C.length[pj]):
        i = C.store[t]
        if R.listed[i]:
            _delist(R, i)
        if not _update_row(R, C, values, largest, place, i, pi, pj, pivot):
            return False
        if R.listed[i]:
            _enlist(R, i)
    for p in range(R.first[pi], R.first[pi] + R.length[pi]):
        j = R.store[p]
        place[j] = -1
        if C.listed[j]:
            _enlist(C, j)
    return True


@compiled(makes_arrays=True)
def _slide(n, R, C, sweep, window, lowest, opened):
    """Opens the lines up to `window` beyond the first one along the sweep that still waits for its pivots."""
    while lowest < n and R.done[sweep[lowest]] and C.done[sweep[lowest]]:
        lowest += 1
    while opened < min(n, lowest + window):
        _open(R, sweep[opened])
        _open(C, sweep[opened])
        opened += 1
    return lowest, opened


@compiled(makes_arrays=True)
def order(n, start, index, data, sweep, limits, threshold, seed, room, floor):
    """Both permutations and the number of pivots found, or OUT_OF_ROOM; limits = (window, free_cost).

    A row whose largest remaining entry is not above `floor` gives no pivot.
    """
    R, C = _lines(n, start, index, room, False), _lines(n, start, index, room, True)
    values, largest, place = np.empty(room), np.zeros(n), np.full(n, -1)
    values[: data.size] = data
    for i in range(n):
        for p in range(start[i], start[i + 1]):
            largest[i] = max(largest[i], abs(data[p]))
    row_perm, col_perm = np.full(n, -1), np.full(n, -1)
    window, free, state = limits[0], True, seed
    lowest, opened = _slide(n, R, C, sweep, n, 0, 0)
    for step in range(n):
        if not free:
            lowest, opened = _slide(n, R, C, sweep, window, lowest, opened)
        cost, i, j, state = _find_pivot(n, R, C, values, largest, threshold, floor, state)
        if free and cost > limits[1]:
            free, i, opened = False, -1, 0
            _close_all(R)
            _close_all(C)
        while i < 0 and opened < n:
            # Nothing admissible among the open lines: the window grows until there is.
            lowest, opened = _slide(n, R, C, sweep, max(window, opened - lowest + 8), lowest, opened)
            cost, i, j, state = _find_pivot(n, R, C, values, largest, threshold, floor, state)
        if i < 0:
            return row_perm, col_perm, step
        row_perm[step], col_perm[step] = i, j
        if not _eliminate(R, C, values, largest, place, i, j):
            return row_perm, col_perm, OUT_OF_ROOM
    return row_perm, col_perm, n

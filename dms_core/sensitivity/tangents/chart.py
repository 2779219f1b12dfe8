"""Tangents of the independent coordinates z = q[chosen], w = v[chosen] and first-order states, in all coordinates.

    phi_q dq = 0,  dq[chosen] = dz          phi_q dv = -(phi_q v)_q dq,  dv[chosen] = dw

Which coordinates are chosen, and which rows of phi_q count, is decided in Python (analyses/independent.py); as long as
they tell the others, the lift is found here, in compiled code, by one small dense factorisation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dms_core.analyses.independent import Independent, independent
from dms_core.assembly.local import evaluate_constraint, views
from dms_core.assembly.model import Model
from dms_core.assembly.tables import CALLS, MODEL, WORK
from dms_core.compiled.arena import Packed, fields, floats, inner, ints, matrix
from dms_core.compiled.jit import compiled
from dms_core.sensitivity.tangents.tables import COLUMNS
from dms_core.simulation.state import STATE

WEAKEST = 1e-6
"""Smallest pivot over the largest number of its row at which the chosen coordinates tell the others."""


class Chart(NamedTuple):
    """Independent coordinates, and storage to lift their tangents."""

    second: np.ndarray
    """Coordinates of second order, (n_s,)."""
    first: np.ndarray
    rows: np.ndarray
    """Independent rows of phi_q, (n_s - n_z,)."""
    chosen: np.ndarray
    """(n_z,)."""
    G: np.ndarray
    """phi_q, shape (n_phi, n_q + 7)."""
    W: np.ndarray
    """(phi_q v)_q."""
    square: np.ndarray
    """(n_s, n_s)."""
    sizes: np.ndarray
    """Largest number of each row of phi_q, (n_s - n_z,)."""
    order: np.ndarray
    side: np.ndarray


CHART = fields(Chart)


def new_chart(model: Model, q: np.ndarray, t: float = 0.0) -> Packed:
    """A packed Chart of the coordinates that tell the others best at q, shape (n_q,)."""
    at: Independent = independent(model, model.constraint_jacobian(q, t=t)[2])
    return packed_chart(model, at.chosen, at.rows)


def packed_chart(model: Model, chosen: np.ndarray, rows: np.ndarray) -> Packed:
    """A packed Chart of these independent coordinates, told by these rows of phi_q."""
    at = np.flatnonzero(model.second_order), np.flatnonzero(~model.second_order), rows, chosen
    second, first, rows, chosen = (x.astype(np.int64) for x in at)
    n = len(second)
    G, W = (np.zeros((model.n_phi, model.n_q + 7)) for _ in range(2))
    storage = np.zeros((n, n)), np.zeros(len(rows)), np.zeros(n, np.int64), np.zeros(n)
    return Packed(Chart(second, first, rows, chosen, G, W, *storage))


@compiled
def factor_square(a, order):
    """LU in place with row exchanges; gives the smallest pivot over the largest number its row began with."""
    n, weakest = a.shape[0], 1.0
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        order[k] = best
        pivot = a[best, k]
        weakest = min(weakest, abs(pivot))
        if not abs(pivot) > 0.0:
            return 0.0
        for j in range(n):
            a[k, j], a[best, j] = a[best, j], a[k, j]
        for i in range(k + 1, n):
            a[i, k] /= pivot
            if a[i, k] != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= a[i, k] * a[k, j]
    return weakest


@compiled
def solve_factored(a, order, b):
    """b becomes the solution of the system that `factor_square` has left in a and order."""
    n = a.shape[0]
    for k in range(n):
        b[k], b[order[k]] = b[order[k]], b[k]
    for k in range(n):
        for j in range(k):
            b[k] -= a[k, j] * b[j]
    for r in range(n):
        k = n - 1 - r
        for j in range(k + 1, n):
            b[k] -= a[k, j] * b[j]
        b[k] /= a[k, k]


@compiled
def _constraint_blocks(m, s, G, W):
    """phi_q and (phi_q v)_q at the q, v of the state."""
    constraints, w = inner(m, MODEL.constraints), inner(s, STATE.w)
    x, q, v = views(constraints, w), floats(s, STATE.q), floats(s, STATE.v)
    local_G, local_W = matrix(w, WORK.G), matrix(w, WORK.W)
    for i in range(q.shape[0]):
        x.q[i], x.v[i] = q[i], v[i]
    G[:, :] = 0.0
    W[:, :] = 0.0
    for e in range(ints(constraints, CALLS.kernel).shape[0]):
        n = evaluate_constraint(x, constraints, e, w, 1)
        for k in range(x.row[e + 1] - x.row[e]):
            for i in range(n):
                column = x.iq[x.iq_ptr[e] + i]
                G[x.row[e] + k, column] += local_G[k, i]
                W[x.row[e] + k, column] += local_W[k, i]


@compiled
def lift(m, s, chart, c):
    """The first n_x columns become those of x = (z, w, first-order states) at the present q, v of the state.

    False where the chosen coordinates no longer tell the others; a chart is then to be made anew.
    """
    second, first = ints(chart, CHART.second), ints(chart, CHART.first)
    rows, chosen = ints(chart, CHART.rows), ints(chart, CHART.chosen)
    a, order, side = matrix(chart, CHART.square), ints(chart, CHART.order), floats(chart, CHART.side)
    G, W, sizes = matrix(chart, CHART.G), matrix(chart, CHART.W), floats(chart, CHART.sizes)
    dq, dv = matrix(c, COLUMNS.dq), matrix(c, COLUMNS.dv)
    n_s, n_z, n_r = second.shape[0], chosen.shape[0], rows.shape[0]
    _constraint_blocks(m, s, G, W)
    a[:, :] = 0.0
    for i in range(n_r):
        size = 0.0
        for j in range(n_s):
            size = max(size, abs(G[rows[i], second[j]]))
        for j in range(n_s):
            a[i, j] = G[rows[i], second[j]] / size
        sizes[i] = size
    for j in range(n_s):
        for i in range(n_z):
            if second[j] == chosen[i]:
                a[n_r + i, j] = 1.0
    if not factor_square(a, order) > WEAKEST:
        return False
    for k in range(2 * n_z + first.shape[0]):
        dq[k, :] = 0.0
        dv[k, :] = 0.0
    for k in range(n_z):
        side[:] = 0.0
        side[n_r + k] = 1.0
        solve_factored(a, order, side)
        for j in range(n_s):
            dq[k, second[j]] = dv[n_z + k, second[j]] = side[j]
        side[:] = 0.0
        for i in range(n_r):
            for j in range(n_s):
                side[i] -= W[rows[i], second[j]] * dq[k, second[j]]
            side[i] /= sizes[i]
        solve_factored(a, order, side)
        for j in range(n_s):
            dv[k, second[j]] = side[j]
    for k in range(first.shape[0]):
        dq[2 * n_z + k, first[k]] = 1.0
    return True


@compiled
def pick(chart, c, k, x):
    """Column k in the chart: x = (dz, dw, first-order states), shape (n_x,)."""
    first, chosen = ints(chart, CHART.first), ints(chart, CHART.chosen)
    dq, dv = matrix(c, COLUMNS.dq), matrix(c, COLUMNS.dv)
    n_z = chosen.shape[0]
    for i in range(n_z):
        x[i], x[n_z + i] = dq[k, chosen[i]], dv[k, chosen[i]]
    for i in range(first.shape[0]):
        x[2 * n_z + i] = dq[k, first[i]]


@compiled
def solve_square(chart):
    """The square system of the last `lift`, with `side` as right-hand side, which becomes the solution.

    Its first rows are those of phi_q over `sizes`, its last ones pick the chosen coordinates.
    """
    solve_factored(matrix(chart, CHART.square), ints(chart, CHART.order), floats(chart, CHART.side))

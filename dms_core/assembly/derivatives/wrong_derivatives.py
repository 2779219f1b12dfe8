"""Which element's derivatives contradict its own equations: looked for only where Newton's method has failed.

Each kernel is called by itself, at the present state and a little to both sides of it along one direction in its q, v
and vdot. Where forward and backward differences agree, so that no kink lies between, its derivatives must agree with
them too.
"""

from __future__ import annotations

import math

import numpy as np

from dms_core.assembly.layout import Call, Layout
from dms_core.assembly.local import evaluate_constraint, evaluate_dynamic, views
from dms_core.assembly.tables import WORK
from dms_core.compiled.arena import Packed, matrix
from dms_core.compiled.jit import compiled

STEP = 1e-6
"""Step of the differences, over 1 + the size of the coordinate."""
SMOOTH, WRONG = 1e-3, 1e-2
"""Difference of forward and backward quotient below which a row is smooth, and of quotient and derivative from which on
the derivative is wrong, over the sum of the sizes of its terms."""


@compiled
def _choose_steps(x, e, n, which, values):
    """Present q, v or vdot (0, 1, 2) of call e, and steps from it, whose signs and sizes make a general direction."""
    y = x.q if which == 0 else (x.v if which == 1 else x.a)
    for i in range(n):
        values[5, i] = y[x.iq[x.iq_ptr[e] + i]]
        values[6, i] = STEP * (1.0 + abs(values[5, i])) * (1.0 - 0.37 * (i % 3)) * (1.0 if i % 2 == 0 else -1.0)


@compiled
def _put(x, e, n, which, values, side):
    """q, v or vdot of call e at the present value (0) or at one step to a side (1, -1)."""
    y = x.q if which == 0 else (x.v if which == 1 else x.a)
    for i in range(n):
        y[x.iq[x.iq_ptr[e] + i]] = values[5, i] + side * values[6, i]


@compiled
def _contradicts(forward, backward, middle, slope, terms):
    """Whether one row's slope is not that of its values on both sides, and these have one."""
    size = terms + abs(forward - middle) + abs(middle - backward)
    if not 0.0 < size < math.inf or size < 1e-9 * (abs(forward) + abs(backward) + abs(middle)):
        return False
    smooth = abs(forward - 2.0 * middle + backward) < SMOOTH * size
    return smooth and abs(0.5 * (forward - backward) - slope) > WRONG * size


@compiled
def _put_slopes(block, rows, m, n, values):
    """m rows at the present value, and what their derivatives give for the steps, with the sizes of its terms."""
    for i in range(m):
        values[0, i] = rows[i]
        values[3, i] = values[4, i] = 0.0
        for j in range(n):
            values[3, i] += block[i, j] * values[6, j]
            values[4, i] += abs(block[i, j] * values[6, j])


@compiled
def _any_contradicts(m, values):
    """Whether any of m rows contradicts its slope."""
    for i in range(m):
        if _contradicts(values[1, i], values[2, i], values[0, i], values[3, i], values[4, i]):
            return True
    return False


@compiled
def first_wrong_dynamic(calls, w, values):
    """First dynamic call whose Jq, Jv or Ja contradicts its rows; -1 if none. `values`: scratch, (7, local size)."""
    x = views(calls, w)
    for e in range(x.kernel.shape[0]):
        for which in range(3):
            n = evaluate_dynamic(x, calls, e, w, 1)
            block = matrix(w, WORK.Jq) if which == 0 else (matrix(w, WORK.Jv) if which == 1 else matrix(w, WORK.Ja))
            _choose_steps(x, e, n, which, values)
            _put_slopes(block, x.r_l, n, n, values)
            for side in range(2):
                _put(x, e, n, which, values, 1.0 if side == 0 else -1.0)
                evaluate_dynamic(x, calls, e, w, 0)
                for i in range(n):
                    values[1 + side, i] = x.r_l[i]
            _put(x, e, n, which, values, 0.0)
            if _any_contradicts(n, values):
                return e
    return -1


@compiled
def first_wrong_constraint(calls, w, values):
    """First constraint call whose phi_q contradicts its phi; -1 if none."""
    x = views(calls, w)
    for e in range(x.kernel.shape[0]):
        n, m = evaluate_constraint(x, calls, e, w, 1), x.row[e + 1] - x.row[e]
        _choose_steps(x, e, n, 0, values)
        _put_slopes(x.G, x.phi_l, m, n, values)
        for side in range(2):
            _put(x, e, n, 0, values, 1.0 if side == 0 else -1.0)
            evaluate_constraint(x, calls, e, w, 0)
            for i in range(m):
                values[1 + side, i] = x.phi_l[i]
        _put(x, e, n, 0, values, 0.0)
        if _any_contradicts(m, values):
            return e
    return -1


def wrong_call(layout: Layout, dynamics: np.ndarray, constraints: np.ndarray, w: Packed) -> Call | None:
    """The first call whose derivatives contradict its equations at the state in the work arrays; else None."""
    values = np.zeros((7, len(w.values.q_l)))
    e = first_wrong_constraint(constraints, w.table, values)
    if e >= 0:
        return layout.constraints[e]
    e = first_wrong_dynamic(dynamics, w.table, values)
    return layout.dynamics[e] if e >= 0 else None

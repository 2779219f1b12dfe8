"""Prediction of a compiled filter over a period: the model's own implicit steps, and the covariance behind them."""

from dms_core.compiled.arena import floats, inner, ints, matrix
from dms_core.compiled.jit import compiled
from dms_core.estimation.compiled.arrays import CODE, FILTER, TABLES
from dms_core.estimation.compiled.numbers import put_rest
from dms_core.estimation.compiled.reading import chart_size
from dms_core.estimation.filter.nominal_world import FINER
from dms_core.sensitivity.tangents.chart import CHART, factor_square, lift, pick, solve_factored
from dms_core.sensitivity.tangents.steps import carry_forward, differentiated_step
from dms_core.sensitivity.tangents.tables import COLUMNS, KIND
from dms_core.simulation.iteration.parts import restart
from dms_core.simulation.state import CLOCK, COUNTS, STATE, rewind

STEEP = 5.0
"""Largest entry of a column of the chart up to which its coordinates tell the motion well."""


@compiled
def _steepest(c, n_x):
    """Largest entry of the chart's columns of positions."""
    dq, largest = matrix(c, COLUMNS.dq), 0.0
    for k in range(n_x):
        for i in range(dq.shape[1]):
            largest = max(largest, abs(dq[k, i]))
    return largest


@compiled
def _begin_columns(f, c, n_x):
    """Columns of inputs and constants, behind those of the chart."""
    dq, dv, du = matrix(c, COLUMNS.dq), matrix(c, COLUMNS.dv), matrix(c, COLUMNS.du)
    places, count = ints(f, FILTER.places), matrix(c, COLUMNS.dq).shape[0]
    for k in range(n_x, count):
        dq[k, :] = 0.0
        dv[k, :] = 0.0
    for k in range(places.shape[0]):
        du[n_x + k, 3 * places[k]] = du[count + n_x + k, 3 * places[k]] = 1.0


@compiled
def _keep_begin(f, s):
    """Where the period begins."""
    q_0, v_0, q, v = floats(f, FILTER.q), floats(f, FILTER.v), floats(s, STATE.q), floats(s, STATE.v)
    for i in range(q.shape[0]):
        q_0[i], v_0[i] = q[i], v[i]
    floats(f, FILTER.begin)[0] = floats(s, STATE.clock)[CLOCK.t]


@compiled
def _back_to_begin(f, s):
    """Where the period began, as if nothing had been computed."""
    rewind(s, floats(f, FILTER.q), floats(f, FILTER.v), 0.0)
    floats(s, STATE.clock)[CLOCK.t] = floats(f, FILTER.begin)[0]


@compiled
def _advance(m, s, o, d, c, chart, f, steps):
    """A period in that many steps, with all columns through them; gives a code."""
    ints(s, STATE.counts)[COUNTS.rates_factored] = 0
    if not restart(m, s, o):
        return CODE.unsolved
    if not lift(m, s, chart, c):
        return CODE.steep
    _begin_columns(f, c, chart_size(chart))
    for _ in range(steps):
        if not differentiated_step(m, s, o, d, floats(f, FILTER.period)[0] / steps, KIND.sdirk2):
            return CODE.unsolved
        carry_forward(m, d, c)
    return CODE.done


@compiled
def predict(t, o):
    """From one time to the next, in more steps where Newton's method needs them; gives a code."""
    m, s, d, c, chart, f = (
        inner(t, TABLES.model), inner(t, TABLES.state), inner(t, TABLES.differentials), inner(t, TABLES.columns),
        inner(t, TABLES.chart), inner(t, TABLES.filter),
    )  # fmt: skip
    n_x = chart_size(chart)
    _keep_begin(f, s)
    code, steps = CODE.unsolved, int(floats(f, FILTER.period)[1])
    for finer in range(FINER):
        if finer > 0:
            _back_to_begin(f, s)
        code = _advance(m, s, o, d, c, chart, f, steps << finer)
        if code != CODE.unsolved:
            break
    if code != CODE.done:
        return code
    _note_transition(f, c, chart, n_x)
    if not lift(m, s, chart, c) or _steepest(c, n_x) > STEEP:
        return CODE.steep
    _drive(f, c, chart)
    _spread(f, matrix(f, FILTER.P).shape[0])
    put_rest(t)
    return CODE.done


@compiled
def _note_transition(f, c, chart, n_x):
    """A from the columns at the end, and the rest at the end."""
    A, x, factor = matrix(f, FILTER.A), floats(f, FILTER.x), floats(f, FILTER.factor)
    rest, mean = floats(f, FILTER.rest), floats(f, FILTER.mean)
    A[:, :] = 0.0
    for k in range(matrix(c, COLUMNS.dq).shape[0]):
        pick(chart, c, k, x)
        for i in range(n_x):
            A[i, k] = x[i]
    for i in range(rest.shape[0]):
        A[n_x + i, n_x + i] = factor[i]
        rest[i] = mean[i] + factor[i] * (rest[i] - mean[i])


@compiled
def _drive(f, c, chart):
    """The part of Q by noise that drives the motion: W = H diag(intensity) H^T with H = (N^T N)^-1 N^T, at the end."""
    intensity, chosen, second = floats(f, FILTER.intensity), ints(chart, CHART.chosen), ints(chart, CHART.second)
    if intensity.shape[0] == 0:
        return
    gram, W, order, x = matrix(f, FILTER.gram), matrix(f, FILTER.driven), ints(f, FILTER.order), floats(f, FILTER.x)
    N, Q, T, n_z = matrix(c, COLUMNS.dq), matrix(f, FILTER.Q), floats(f, FILTER.period)[0], chosen.shape[0]
    for i in range(n_z):
        for k in range(n_z):
            gram[i, k] = W[i, k] = 0.0
            for j in second:
                gram[i, k] += N[i, j] * N[k, j]
                W[i, k] += intensity[j] * N[i, j] * N[k, j]
    factor_square(gram, order)
    for side in range(2):
        # Rows first, then what were columns: W is symmetric.
        for i in range(n_z):
            for k in range(n_z):
                x[k] = W[i, k] if side == 0 else W[k, i]
            solve_factored(gram, order, x)
            for k in range(n_z):
                if side == 0:
                    W[i, k] = x[k]
                else:
                    W[k, i] = x[k]
    for i in range(n_z):
        for k in range(n_z):
            Q[i, k], Q[n_z + i, n_z + k] = W[i, k] * T**3 / 3.0, W[i, k] * T
            Q[i, n_z + k] = Q[n_z + i, k] = W[i, k] * T * T / 2.0


@compiled
def _spread(f, n):
    """P = A P A^T + Q."""
    P, A, half, Q = matrix(f, FILTER.P), matrix(f, FILTER.A), matrix(f, FILTER.half), matrix(f, FILTER.Q)
    for i in range(n):
        for j in range(n):
            half[i, j] = 0.0
            for k in range(n):
                half[i, j] += A[i, k] * P[k, j]
    for i in range(n):
        for j in range(i + 1):
            total = Q[i, j]
            for k in range(n):
                total += half[i, k] * A[j, k]
            P[i, j] = P[j, i] = total

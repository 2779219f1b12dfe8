"""One step of the extended filter on packed arrays: prediction, correction and projection without a Python object.

The formulas are those of kalman.py. Readings are taken one after the other, which for independent noise is the same
correction, by P - K S K^T of each, which for the best gain is what Joseph's form gives. The sensors' derivatives are
central differences over the columns of the chart, of the rates and multipliers that belong to the displaced states.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.assembly.readings.sensing import read_sensors
from dms_core.assembly.tables import SIGNALS, WORK
from dms_core.compiled.arena import fields, floats, inner, ints, matrix
from dms_core.compiled.jit import compiled
from dms_core.sensitivity.tangents.chart import CHART, lift, pick, solve_square
from dms_core.sensitivity.tangents.steps import carry_forward, differentiated_step
from dms_core.sensitivity.tangents.tables import COLUMNS, KIND
from dms_core.simulation.iteration.parts import PARTS, restart, run_part
from dms_core.simulation.state import CLOCK, COUNTS, STATE

DISPLACED = 1e-5
"""Displacement of a central difference over the size of its column: its truncation leaves about 1e-10."""
CLOSED, ITERATIONS = 1e-12, 20
"""Largest |phi| left by a projection, and its iterations."""
STEEP = 5.0
"""Largest entry of a column of the chart up to which its coordinates tell the motion well."""


class FilterArrays(NamedTuple):
    """What a filter holds and works with: n estimated numbers, n_x of them the chart's, c channels."""

    rest: np.ndarray
    """Inputs, then biases."""
    mean: np.ndarray
    """That the rest goes back to."""
    factor: np.ndarray
    """Of rest - mean over a period."""
    Q: np.ndarray
    """Covariance that joins over a period, (n, n)."""
    P: np.ndarray
    A: np.ndarray
    half: np.ndarray
    """A P, (n, n)."""
    rows: np.ndarray
    """Rows of the estimated inputs in the signals."""
    places: np.ndarray
    """The same inputs among all inputs."""
    outputs: np.ndarray
    """Channels among the sensors' components."""
    R: np.ndarray
    bias: np.ndarray
    """Place of each channel's bias in the rest, -1 for none."""
    turned: np.ndarray
    """1 for an angle, whose residual is the nearest turn."""
    C: np.ndarray
    """(c, n)."""
    y: np.ndarray
    high: np.ndarray
    low: np.ndarray
    expected: np.ndarray
    reading: np.ndarray
    """(c,), NaN where a channel tells nothing."""
    x: np.ndarray
    gain: np.ndarray
    """P c^T, (n,)."""
    q: np.ndarray
    v: np.ndarray
    period: np.ndarray
    """Period [s] and number of its steps, (2,)."""
    nis: np.ndarray
    """Of the last correction, and its readings, (2,)."""


class Code(NamedTuple):
    """How a step ended."""

    done: int
    unsolved: int
    """A step of the equations, or their rates."""
    steep: int
    """The chart is to be made anew."""
    open: int
    """No state on the constraints is near the corrected one."""
    not_finite: int


FILTER, CODE = fields(FilterArrays), fields(Code)


@compiled
def settle(m, s, o):
    """Rates and multipliers of the present state; False if there are none."""
    ints(s, STATE.counts)[COUNTS.rates_factored] = 0
    return restart(m, s, o)


@compiled
def hold_inputs(s, f):
    """The estimated inputs into the signals."""
    c, rows, rest = matrix(inner(s, STATE.signals), SIGNALS.c), ints(f, FILTER.rows), floats(f, FILTER.rest)
    for i in range(rows.shape[0]):
        c[rows[i], 0] = rest[i]


@compiled
def _steepest(c, n_x):
    """Largest entry of the chart's columns of positions."""
    dq, largest = matrix(c, COLUMNS.dq), 0.0
    for k in range(n_x):
        for i in range(dq.shape[1]):
            largest = max(largest, abs(dq[k, i]))
    return largest


@compiled
def _chart_size(chart):
    return 2 * ints(chart, CHART.chosen).shape[0] + ints(chart, CHART.first).shape[0]


@compiled
def predict(m, s, o, d, c, chart, f):
    """From one time to the next; gives a code."""
    n_x, places = _chart_size(chart), ints(f, FILTER.places)
    if not settle(m, s, o):
        return CODE.unsolved
    if not lift(m, s, chart, c):
        return CODE.steep
    dq, dv, du = matrix(c, COLUMNS.dq), matrix(c, COLUMNS.dv), matrix(c, COLUMNS.du)
    count = dq.shape[0]
    for k in range(n_x, count):
        dq[k, :] = 0.0
        dv[k, :] = 0.0
        du[k, 3 * places[k - n_x]] = du[count + k, 3 * places[k - n_x]] = 1.0
    period = floats(f, FILTER.period)
    for _ in range(int(period[1])):
        if not differentiated_step(m, s, o, d, period[0] / period[1], KIND.sdirk2):
            return CODE.unsolved
        carry_forward(m, d, c)
    A, x, factor = matrix(f, FILTER.A), floats(f, FILTER.x), floats(f, FILTER.factor)
    rest, mean, n = floats(f, FILTER.rest), floats(f, FILTER.mean), matrix(f, FILTER.P).shape[0]
    A[:, :] = 0.0
    for k in range(count):
        pick(chart, c, k, x)
        for i in range(n_x):
            A[i, k] = x[i]
    for i in range(rest.shape[0]):
        A[n_x + i, n_x + i] = factor[i]
        rest[i] = mean[i] + factor[i] * (rest[i] - mean[i])
    _spread(f, n)
    hold_inputs(s, f)
    return CODE.done


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


@compiled
def _read(m, s, o, sensing, y):
    """All sensors of the present state; False where it has no rates."""
    if not settle(m, s, o):
        return False
    read_sensors(
        sensing, inner(s, STATE.signals), floats(s, STATE.clock)[CLOCK.t], floats(s, STATE.q), floats(s, STATE.v),
        floats(s, STATE.vd), floats(s, STATE.lam), True, y,
    )  # fmt: skip
    return True


@compiled
def _note_slope(f, k, width):
    """Column k of C from both readings."""
    C, high, low, outputs = matrix(f, FILTER.C), floats(f, FILTER.high), floats(f, FILTER.low), ints(f, FILTER.outputs)
    turned = ints(f, FILTER.turned)
    for i in range(outputs.shape[0]):
        rise = high[outputs[i]] - low[outputs[i]]
        if turned[i] == 1:
            rise -= 2.0 * math.pi * math.floor(rise / (2.0 * math.pi) + 0.5)
        C[i, k] = rise / width


@compiled
def _by_chart(m, s, o, c, sensing, f, n_x):
    """Columns of C by the chart; the state is as before."""
    q, v, dq, dv = floats(s, STATE.q), floats(s, STATE.v), matrix(c, COLUMNS.dq), matrix(c, COLUMNS.dv)
    q_0, v_0, n = floats(f, FILTER.q), floats(f, FILTER.v), floats(s, STATE.q).shape[0]
    fine = True
    for k in range(n_x):
        size = 1.0
        for i in range(n):
            size = max(size, abs(dq[k, i]), abs(dv[k, i]))
        for sign in (1.0, -1.0):
            for i in range(n):
                q[i], v[i] = q_0[i] + sign * DISPLACED / size * dq[k, i], v_0[i] + sign * DISPLACED / size * dv[k, i]
            fine = fine and _read(m, s, o, sensing, floats(f, FILTER.high if sign > 0.0 else FILTER.low))
        _note_slope(f, k, 2.0 * DISPLACED / size)
    for i in range(n):
        q[i], v[i] = q_0[i], v_0[i]
    return fine


@compiled
def _by_inputs(m, s, o, sensing, f, n_x):
    """Columns of C by the estimated inputs."""
    values, rows, rest = matrix(inner(s, STATE.signals), SIGNALS.c), ints(f, FILTER.rows), floats(f, FILTER.rest)
    fine = True
    for k in range(rows.shape[0]):
        h = DISPLACED * max(1.0, abs(rest[k]))
        for sign in (1.0, -1.0):
            values[rows[k], 0] = rest[k] + sign * h
            fine = fine and _read(m, s, o, sensing, floats(f, FILTER.high if sign > 0.0 else FILTER.low))
        _note_slope(f, n_x + k, 2.0 * h)
        values[rows[k], 0] = rest[k]
    return fine


@compiled
def _expect(m, s, o, c, chart, sensing, f):
    """What channels should show, and C; gives a code."""
    n_x, bias, rest = _chart_size(chart), ints(f, FILTER.bias), floats(f, FILTER.rest)
    q, v, q_0, v_0 = floats(s, STATE.q), floats(s, STATE.v), floats(f, FILTER.q), floats(f, FILTER.v)
    if not lift(m, s, chart, c) or _steepest(c, n_x) > STEEP:
        return CODE.steep
    y, C, outputs = floats(f, FILTER.y), matrix(f, FILTER.C), ints(f, FILTER.outputs)
    if not _read(m, s, o, sensing, y):
        return CODE.unsolved
    for i in range(q.shape[0]):
        q_0[i], v_0[i] = q[i], v[i]
    C[:, :] = 0.0
    if not (_by_chart(m, s, o, c, sensing, f, n_x) and _by_inputs(m, s, o, sensing, f, n_x)):
        return CODE.unsolved
    expected = floats(f, FILTER.expected)
    for i in range(outputs.shape[0]):
        expected[i] = y[outputs[i]]
        if bias[i] >= 0:
            expected[i] += rest[bias[i]]
            C[i, n_x + bias[i]] += 1.0
    return CODE.done


@compiled
def _take_readings(f):
    """Change x of the mean, P and NIS by all readings, one after the other."""
    C, P, R, x = matrix(f, FILTER.C), matrix(f, FILTER.P), floats(f, FILTER.R), floats(f, FILTER.x)
    reading, expected, turned = floats(f, FILTER.reading), floats(f, FILTER.expected), ints(f, FILTER.turned)
    gain, nis, n = floats(f, FILTER.gain), floats(f, FILTER.nis), matrix(f, FILTER.P).shape[0]
    x[:], nis[:] = 0.0, 0.0
    for c in range(reading.shape[0]):
        if math.isnan(reading[c]):
            continue
        S, r = R[c], reading[c] - expected[c]
        if turned[c] == 1:
            r -= 2.0 * math.pi * math.floor(r / (2.0 * math.pi) + 0.5)
        for i in range(n):
            gain[i] = 0.0
            for j in range(n):
                gain[i] += P[i, j] * C[c, j]
            S += C[c, i] * gain[i]
            r -= C[c, i] * x[i]
        nis[0] += r * r / S
        nis[1] += 1.0
        for i in range(n):
            x[i] += gain[i] / S * r
            for j in range(n):
                P[i, j] -= gain[i] * gain[j] / S
    for i in range(n):
        for j in range(i):
            P[i, j] = P[j, i] = 0.5 * (P[i, j] + P[j, i])


@compiled
def _move(m, s, c, chart, f):
    """Add x to the mean: along the chart, then onto the constraints with z, w and s kept; gives a code."""
    n_x, chosen = _chart_size(chart), ints(chart, CHART.chosen)
    second, rows, x = ints(chart, CHART.second), ints(chart, CHART.rows), floats(f, FILTER.x)
    q, v, dq = floats(s, STATE.q), floats(s, STATE.v), matrix(c, COLUMNS.dq)
    v_0, side, n_z = floats(f, FILTER.v), floats(chart, CHART.side), chosen.shape[0]
    sizes, phi = floats(chart, CHART.sizes), floats(inner(s, STATE.w), WORK.phi)
    for k in range(n_z):
        v_0[chosen[k]] = v[chosen[k]] + x[n_z + k]
    for k in range(n_x):
        if k < n_z or k >= 2 * n_z:
            for i in range(q.shape[0]):
                q[i] += dq[k, i] * x[k]
    for _ in range(ITERATIONS):
        if not lift(m, s, chart, c):
            return CODE.steep
        run_part(m, s, PARTS.constraints)
        largest = 0.0
        for i in range(rows.shape[0]):
            largest = max(largest, abs(phi[rows[i]]))
        if not largest < math.inf:
            return CODE.not_finite
        if largest < CLOSED:
            for j in range(second.shape[0]):
                v[second[j]] = 0.0
                for k in range(n_z):
                    v[second[j]] += dq[k, second[j]] * v_0[chosen[k]]
            return CODE.done
        for j in range(second.shape[0]):
            side[j] = -phi[rows[j]] / sizes[j] if j < rows.shape[0] else 0.0
        solve_square(chart)
        for j in range(second.shape[0]):
            q[second[j]] += side[j]
    return CODE.open


@compiled
def correct(m, s, o, c, chart, sensing, f):
    """Take the readings at the present time; gives a code."""
    code = _expect(m, s, o, c, chart, sensing, f)
    if code != CODE.done:
        return code
    _take_readings(f)
    n_x, rest, x = _chart_size(chart), floats(f, FILTER.rest), floats(f, FILTER.x)
    P = matrix(f, FILTER.P)
    for i in range(P.shape[0]):
        if not (abs(x[i]) < math.inf and P[i, i] > 0.0 and P[i, i] < math.inf):
            return CODE.not_finite
    for i in range(rest.shape[0]):
        rest[i] += x[n_x + i]
    hold_inputs(s, f)
    return _move(m, s, c, chart, f)


@compiled
def filter_step(m, s, o, d, c, chart, sensing, f):
    """Prediction over a period, and the correction at its end; gives a code."""
    code = predict(m, s, o, d, c, chart, f)
    return code if code != CODE.done else correct(m, s, o, c, chart, sensing, f)

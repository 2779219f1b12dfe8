"""Correction of a compiled filter: readings, projection onto the constraints, iterated form, bounds.

Readings are taken one after the other, which for independent noise is the same as all at once, each in Joseph's form.
"""

import math

from dms_core.assembly.tables import WORK
from dms_core.compiled.arena import floats, inner, ints, matrix
from dms_core.compiled.jit import compiled
from dms_core.estimation.compiled.arrays import CODE, FILTER, TABLES
from dms_core.estimation.compiled.numbers import put_rest
from dms_core.estimation.compiled.reading import chart_size, expect, nearest_turn
from dms_core.estimation.filter.cut import cut_moments
from dms_core.sensitivity.tangents.chart import CHART, lift, solve_square
from dms_core.sensitivity.tangents.tables import COLUMNS
from dms_core.simulation.iteration.parts import PARTS, run_part
from dms_core.simulation.state import STATE

CLOSED, ITERATIONS = 1e-13, 20
"""Largest |phi| left by a projection, over the size of the coordinates, and its iterations."""
REPEATED, SMALL = 20, 1e-9
"""Corrections of the iterated form, and the last one over the deviations."""
PASSES = 20
"""Rounds in which bounds are looked at."""


@compiled
def _note_mean(t, x):
    """The mean (z, w, states of first order, rest), shape (n,)."""
    s, chart, f = inner(t, TABLES.state), inner(t, TABLES.chart), inner(t, TABLES.filter)
    chosen, first, rest = ints(chart, CHART.chosen), ints(chart, CHART.first), floats(f, FILTER.rest)
    q, v, n_z = floats(s, STATE.q), floats(s, STATE.v), chosen.shape[0]
    for k in range(n_z):
        x[k], x[n_z + k] = q[chosen[k]], v[chosen[k]]
    for k in range(first.shape[0]):
        x[2 * n_z + k] = q[first[k]]
    n_x = 2 * n_z + first.shape[0]
    for k in range(rest.shape[0]):
        x[n_x + k] = rest[k]


@compiled
def _take_readings(f, again):
    """Change x and P by all readings, one after the other.

    x counts from the point to which C and the expected readings belong: it comes as the mean before the correction,
    which is 0 unless the correction is made `again`, and goes as the corrected one. NIS is noted the first time.
    """
    C, P, R, x = matrix(f, FILTER.C), matrix(f, FILTER.P), floats(f, FILTER.R), floats(f, FILTER.x)
    reading, expected, turned = floats(f, FILTER.reading), floats(f, FILTER.expected), ints(f, FILTER.turned)
    nis, innovation, n = floats(f, FILTER.nis), floats(f, FILTER.innovation), P.shape[0]
    for c in range(reading.shape[0]):
        if math.isnan(reading[c]):
            continue
        r = reading[c] - expected[c]
        if turned[c] == 1:
            r = nearest_turn(r)
        if not again:
            innovation[c] = r
        for i in range(n):
            r -= C[c, i] * x[i]
        S = _take(P, C[c], R[c], r, x, floats(f, FILTER.gain), floats(f, FILTER.left))
        if not again:
            nis[0] += r * r / S
            nis[1] += 1.0


@compiled
def _take(P, h, noise, r, x, gain, left):
    """Correct x and P by one reading, P = (1 - k h) P (1 - k h)^T + noise k k^T; gives the innovation's variance."""
    S, n = noise, P.shape[0]
    for i in range(n):
        gain[i] = 0.0
        for j in range(n):
            gain[i] += P[i, j] * h[j]
        S += h[i] * gain[i]
    for i in range(n):
        for j in range(n):
            P[i, j] -= gain[i] / S * gain[j]
    for i in range(n):
        left[i] = 0.0
        for j in range(n):
            left[i] += P[i, j] * h[j]
    for i in range(n):
        x[i] += gain[i] / S * r
        for j in range(n):
            P[i, j] += (noise * gain[i] / S - left[i]) * gain[j] / S
    for i in range(n):
        for j in range(i):
            P[i, j] = P[j, i] = 0.5 * (P[i, j] + P[j, i])
    return S


@compiled
def _go_on_by(t):
    """Add x to the mean: the rest, and the state along the chart and then onto the constraints; gives a code."""
    f, n_x = inner(t, TABLES.filter), chart_size(inner(t, TABLES.chart))
    P, x, rest = matrix(f, FILTER.P), floats(f, FILTER.x), floats(f, FILTER.rest)
    for i in range(P.shape[0]):
        if not (abs(x[i]) < math.inf and P[i, i] > 0.0 and P[i, i] < math.inf):
            return CODE.not_finite
    for i in range(rest.shape[0]):
        rest[i] += x[n_x + i]
    put_rest(t)
    return _move(t)


@compiled
def _move(t):
    """Add x to the state along the chart, then onto the constraints with z and w kept; gives a code."""
    m, s, c, chart, f = (
        inner(t, TABLES.model), inner(t, TABLES.state), inner(t, TABLES.columns), inner(t, TABLES.chart),
        inner(t, TABLES.filter),
    )  # fmt: skip
    n_x, chosen = chart_size(chart), ints(chart, CHART.chosen)
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
        largest, size = 0.0, 1.0
        for i in range(rows.shape[0]):
            largest = max(largest, abs(phi[rows[i]]))
        for i in range(q.shape[0]):
            size = max(size, abs(q[i]))
        if not largest < math.inf:
            return CODE.not_finite
        if largest <= CLOSED * size:
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
def _told(f):
    """Whether any channel tells something."""
    for reading in floats(f, FILTER.reading):
        if not math.isnan(reading):
            return True
    return False


@compiled
def correct(t, o):
    """Take the readings at the present time; gives a code."""
    f = inner(t, TABLES.filter)
    nis, x, P = floats(f, FILTER.nis), floats(f, FILTER.x), matrix(f, FILTER.P)
    nis[0] = nis[1] = 0.0
    if not _told(f):
        return CODE.done
    code = expect(t)
    if code != CODE.done:
        return code
    start, P_start = floats(f, FILTER.start), matrix(f, FILTER.P_start)
    _note_mean(t, start)
    for i in range(P.shape[0]):
        x[i] = 0.0
        for j in range(P.shape[0]):
            P_start[i, j] = P[i, j]
    _take_readings(f, False)
    code = _go_on_by(t)
    if code == CODE.done and ints(f, FILTER.iterated)[0] == 1:
        code = _repeat(t)
    return _put_within_bounds(t) if code == CODE.done else code


@compiled
def _repeat(t):
    """The correction about what it gave, until it gives the same; gives a code."""
    f = inner(t, TABLES.filter)
    x, P, start, P_start = (
        floats(f, FILTER.x), matrix(f, FILTER.P), floats(f, FILTER.start), matrix(f, FILTER.P_start),
    )  # fmt: skip
    for _ in range(REPEATED):
        code = expect(t)
        if code != CODE.done:
            return code
        _note_mean(t, x)
        for i in range(P.shape[0]):
            x[i] = start[i] - x[i]
            for j in range(P.shape[0]):
                P[i, j] = P_start[i, j]
        _take_readings(f, True)
        code, change = _go_on_by(t), 0.0
        if code != CODE.done:
            return code
        for i in range(P.shape[0]):
            change = max(change, abs(x[i]) / math.sqrt(P_start[i, i]))
        if change < SMALL:
            break
    return CODE.done


@compiled
def _any_outside(f, x):
    """Whether a component of the mean x lies outside its bounds."""
    bounded, least, most = ints(f, FILTER.bounded), floats(f, FILTER.least), floats(f, FILTER.most)
    for i in range(bounded.shape[0]):
        if not least[i] <= x[bounded[i]] <= most[i]:
            return True
    return False


@compiled
def _cut(P, x, column, k, low, high):
    """Cut component k of the distribution at its bounds; the others follow by their correlation."""
    deviation, n = math.sqrt(P[k, k]), P.shape[0]
    shift, share = cut_moments((low - x[k]) / deviation, (high - x[k]) / deviation)
    for i in range(n):
        column[i] = P[i, k] / P[k, k]
    lost = P[k, k] * (1.0 - share)
    for i in range(n):
        x[i] += column[i] * shift * deviation
        for j in range(n):
            P[i, j] -= column[i] * column[j] * lost


@compiled
def _put_within_bounds(t):
    """Cut what lies outside its bounds, as `KalmanFilter.within_bounds`; gives a code."""
    f = inner(t, TABLES.filter)
    bounded, least, most = ints(f, FILTER.bounded), floats(f, FILTER.least), floats(f, FILTER.most)
    x, start, P = floats(f, FILTER.x), floats(f, FILTER.start), matrix(f, FILTER.P)
    if bounded.shape[0] == 0:
        return CODE.done
    _note_mean(t, start)
    if not _any_outside(f, start):
        return CODE.done
    for i in range(P.shape[0]):
        x[i] = start[i]
    for _ in range(PASSES):
        if not _any_outside(f, x):
            break
        for i in range(bounded.shape[0]):
            if not least[i] <= x[bounded[i]] <= most[i]:
                _cut(P, x, floats(f, FILTER.gain), bounded[i], least[i], most[i])
    for i in range(bounded.shape[0]):
        x[bounded[i]] = min(max(x[bounded[i]], least[i]), most[i])
    for i in range(P.shape[0]):
        x[i] -= start[i]
    return _go_on_by(t)

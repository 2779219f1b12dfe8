"""What a compiled filter expects its channels to show, and the derivatives C, by the sensors' own partial derivatives.

The adjoints of the sensors by q, v, inputs and declared numbers (sensitivity/tangents/readings.py), pulled back through
accelerations and multipliers, are multiplied by the columns of the chart.
"""

import math

from dms_core.compiled.arena import floats, inner, ints, matrix
from dms_core.compiled.jit import compiled
from dms_core.estimation.compiled.arrays import CODE, FILTER, TABLES
from dms_core.sensitivity.tangents.chart import CHART, lift
from dms_core.sensitivity.tangents.reading_tables import READINGS
from dms_core.sensitivity.tangents.readings import pull_back
from dms_core.sensitivity.tangents.tables import ADJOINTS, COLUMNS
from dms_core.simulation.iteration.parts import PARTS, run_rates, set_inputs
from dms_core.simulation.state import CLOCK, COUNTS, STATE


@compiled
def chart_size(chart):
    """Number of states of a chart."""
    return 2 * ints(chart, CHART.chosen).shape[0] + ints(chart, CHART.first).shape[0]


@compiled
def nearest_turn(angle):
    """An angle less whole turns, from -pi to pi."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@compiled
def expect(t):
    """What channels should show at the present state, and C; the chart's columns are lifted there. Gives a code."""
    m, s, c, chart = (
        inner(t, TABLES.model), inner(t, TABLES.state), inner(t, TABLES.columns), inner(t, TABLES.chart),
    )  # fmt: skip
    r, f = inner(t, TABLES.readings), inner(t, TABLES.filter)
    if not lift(m, s, chart, c):
        return CODE.steep
    ints(s, STATE.counts)[COUNTS.rates_factored] = 0
    set_inputs(m, s, floats(s, STATE.clock)[CLOCK.t], False)
    if not run_rates(m, s, PARTS.consistent_rates, 0.0):
        return CODE.unsolved
    if not pull_back(m, s, inner(t, TABLES.differentials), r):
        return CODE.not_finite
    _fill(f, c, r, chart_size(chart))
    return CODE.done


@compiled
def _fill(f, c, r, n_x):
    """Expected readings and C from the sensors' values and adjoints."""
    found, y, at = inner(r, READINGS.found), floats(r, READINGS.y), ints(f, FILTER.found_at)
    aq, av, au, ap = (
        matrix(found, ADJOINTS.aq), matrix(found, ADJOINTS.av), matrix(found, ADJOINTS.au), matrix(found, ADJOINTS.ap),
    )  # fmt: skip
    dq, dv, C = matrix(c, COLUMNS.dq), matrix(c, COLUMNS.dv), matrix(f, FILTER.C)
    places, bias, rest = ints(f, FILTER.places), ints(f, FILTER.bias), floats(f, FILTER.rest)
    expected, n_u, n_k = floats(f, FILTER.expected), places.shape[0], floats(f, FILTER.declared).shape[0]
    C[:, :] = 0.0
    for i in range(at.shape[0]):
        row = at[i]
        expected[i] = y[row]
        for k in range(n_x):
            for j in range(dq.shape[1]):
                C[i, k] += aq[row, j] * dq[k, j] + av[row, j] * dv[k, j]
        for k in range(n_u):
            C[i, n_x + k] = au[row, 3 * places[k]]
        for k in range(n_k):
            C[i, n_x + n_u + k] = ap[row, k]
        if bias[i] >= 0:
            expected[i] += rest[bias[i]]
            C[i, n_x + bias[i]] += 1.0

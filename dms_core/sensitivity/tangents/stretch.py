"""Recorded steps behind each other, taken again and differentiated in one compiled call.

Rows of a stretch are recorded states (q, v) with their times; row 0 is the one ahead of the first step, which BDF2
reaches back to. Step j leads from row j to row j + 1.
"""

import numpy as np

from dms_core.compiled.arena import floats, ints
from dms_core.compiled.jit import compiled
from dms_core.sensitivity.tangents.readings import add_readings, pull_back
from dms_core.sensitivity.tangents.steps import carry_back, carry_forward, differentiated_step
from dms_core.sensitivity.tangents.tables import DIFFERENTIALS, NUMBERS
from dms_core.simulation.initial_rates import rates_again
from dms_core.simulation.iteration.parts import set_inputs
from dms_core.simulation.state import CLOCK, COUNTS, STATE


@compiled
def put_row(s, times, rows, j):
    """Row j into the world, without rates, on the way from the row before."""
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    q_before, v_before = floats(s, STATE.q_before), floats(s, STATE.v_before)
    n = q.shape[0]
    for i in range(n):
        q[i], v[i] = rows[j, i], rows[j, n + i]
        q_before[i], v_before[i] = rows[j - 1, i], rows[j - 1, n + i]
        qd[i], vd[i] = v[i], 0.0
    lam, lam_before, mu = floats(s, STATE.lam), floats(s, STATE.lam_before), floats(s, STATE.mu)
    for k in range(lam.shape[0]):
        lam_before[k], mu[k] = lam[k], 0.0
    clock = floats(s, STATE.clock)
    clock[CLOCK.t], clock[CLOCK.h_before] = times[j], times[j] - times[j - 1]
    ints(s, STATE.counts)[COUNTS.restart] = 0


@compiled
def size(times, j):
    """Of step j; it must not end behind a jump of the inputs, not even by rounding."""
    h = times[j + 1] - times[j]
    while times[j] + h > times[j + 1]:
        h = np.nextafter(h, 0.0)
    return h


@compiled
def put_end(s, d, times, rows, j):
    """The end of step j, row j + 1, and the accelerations on the way there."""
    v, vd, n = floats(s, STATE.v), floats(s, STATE.vd), floats(s, STATE.q).shape[0]
    end_q, end_v, h = floats(d, DIFFERENTIALS.end_q), floats(d, DIFFERENTIALS.end_v), times[j + 1] - times[j]
    for i in range(n):
        end_q[i], end_v[i] = rows[j + 1, i], rows[j + 1, n + i]
        vd[i] = (end_v[i] - v[i]) / h


@compiled
def take_again(m, s, o, d, times, rows, j, kind, known):
    """Step j, differentiated; `known`: row j + 1 is its end, else that is not read. False where it cannot be solved."""
    numbers, h = floats(d, DIFFERENTIALS.numbers), size(times, j)
    numbers[NUMBERS.known] = 1.0 if known else 0.0
    put_row(s, times, rows, j)
    if known:
        put_end(s, d, times, rows, j)
        if differentiated_step(m, s, o, d, h, kind):
            return True
        # The guess of the method may lead farther than one that lies beyond a kink.
        numbers[NUMBERS.known] = 0.0
    return differentiated_step(m, s, o, d, h, kind)


@compiled
def steps_forward(m, s, o, d, c, times, rows, kinds, first):
    """The columns from row `first` to the last; gives the row that was reached, before a step that fails."""
    for j in range(first, times.shape[0] - 1):
        if not take_again(m, s, o, d, times, rows, j, kinds[j], True):
            return j
        carry_forward(m, d, c)
    return times.shape[0] - 1


@compiled
def read_row(m, s, d, r, times, rows, j, before):
    """The sensors of r at row j, with inputs before or behind a jump; False where no accelerations belong to it."""
    counts = ints(s, STATE.counts)
    stale = counts[COUNTS.stale]
    put_row(s, times, rows, j)
    set_inputs(m, s, times[j], before)
    if not rates_again(m, s):
        return False
    # The Newton matrix at hand is that of a stage still.
    counts[COUNTS.stale] = stale
    return pull_back(m, s, d, r)


@compiled
def read_back(m, s, d, b, r, sums, shares, times, rows, j):
    """Add shares[j] times `sums` of the sensors of r at row j to the adjoints; gives j, or -j where that fails.

    Row 1 is read where a jump is there, with inputs behind it; else it ends another stretch.
    """
    starts = times[j] == times[j - 1]
    if shares[j] == 0.0 or (j == 1 and not starts):
        return j
    if not read_row(m, s, d, r, times, rows, j, not starts):
        return -j
    add_readings(r, b, sums, shares[j])
    return j


@compiled
def steps_back(m, s, o, d, b, r, sums, shares, times, rows, kinds, last):
    """The adjoints from row `last` to row 1, with what sensors add, see `read_back`.

    Gives the row that was reached, behind a step that fails, or less than 0 where the reading of a row does.
    """
    for j in range(last, 1, -1):
        if read_back(m, s, d, b, r, sums, shares, times, rows, j) < 0:
            return -j
        if not take_again(m, s, o, d, times, rows, j - 1, kinds[j - 1], True):
            return j
        carry_back(m, d, b)
    return read_back(m, s, d, b, r, sums, shares, times, rows, 1)

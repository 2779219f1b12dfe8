"""Compiled parts of a differentiated control period: differences of what acts, recorded steps, tangents along them."""

from __future__ import annotations

from dms_core.compiled.jit import compiled
from dms_core.kernels import (
    CLOCK,
    COUNTS,
    DONE,
    OUTCOME,
    STATE,
    Options,
    T,
    advance,
    floats,
    inner,
    ints,
    matrix,
)
from dms_core.sensitivity.tangents.steps import carry_forward, differentiated_step
from dms_core.sensitivity.tangents.tables import COLUMNS, DIFFERENTIALS, KIND, NUMBERS
from dms_core.simulation.iteration.parts import PARTS as SOLVER
from dms_core.simulation.iteration.parts import run_rates, set_inputs
from dms_core.simulation.methods.sdirk2 import GAMMA
from exo_env.places import places
from exo_env.tables import DYNAMICS, WORLD
from exo_env.world.kernels.control_period import (
    finish,
    no_record,
    options_of,
    sense,
    set_commands,
    set_excitations,
)
from exo_env.world.kernels.load_step import put_load

PARTS = places(("load", "drive", "patient", "sense", "finish"))
"""The parts of a control period beside the solver."""
DIFFERENCE = 1e-6
"""Step of a central difference, relative to the number where that is above 1: rounding and curvature leave 1e-9."""
RAMP = places(("input", "begin", "length"))
"""Places in a row of `ramps`: number of the input, when it left the value `from` and how long it takes to `to` [s]."""


@compiled
def act(w, part):
    """Let the drive or the patient act."""
    if part == PARTS.drive:
        set_commands(w)
    else:
        set_excitations(w)


@compiled
def do_part(w, part):
    """Do one part of a control period."""
    if part == PARTS.load:
        put_load(w)
    elif part == PARTS.drive or part == PARTS.patient:
        act(w, part)
    elif part == PARTS.sense:
        sense(w)
    else:
        finish(w)


@compiled
def _copy(memory, kept, back):
    """Copy all numbers of the memory into `kept`, or back from there."""
    k = 0
    for f in range(memory.shape[0]):
        x = floats(memory, f)
        for i in range(x.shape[0]):
            if back:
                x[i] = kept[k]
            else:
                kept[k] = x[i]
            k += 1


@compiled
def difference_part(w, part, memory, read, written, kept, slope):
    """slope[i, j]: number written[i] behind a part of the period by number read[j] ahead of it, by central differences.

    Everything is left as it was.

    Args:
        w: the world.
        part: drive or patient, of PARTS.
        memory: a table of all arrays that the part changes, as vectors.
        read: field of the memory and place in it, a row each, shape (n, 2).
        written: likewise, shape (m, 2).
        kept: storage for the memory.
        slope: shape (m, n).
    """
    _copy(memory, kept, False)
    for j in range(read.shape[0]):
        x = floats(memory, read[j, 0])
        h = DIFFERENCE * max(abs(x[read[j, 1]]), 1.0)
        for sign in (1.0, -1.0):
            x[read[j, 1]] += sign * h
            act(w, part)
            for i in range(written.shape[0]):
                after = floats(memory, written[i, 0])[written[i, 1]]
                slope[i, j] = after if sign > 0.0 else (slope[i, j] - after) / (2.0 * h)
            _copy(memory, kept, True)


@compiled
def put_row(s, rows, k):
    """Row k of the record: time, q and v."""
    q, v = floats(s, STATE.q), floats(s, STATE.v)
    rows[k, 0] = floats(s, STATE.clock)[T]
    for i in range(q.shape[0]):
        rows[k, 1 + i], rows[k, 1 + q.shape[0] + i] = q[i], v[i]


@compiled
def record_steps(w, stop, rows):
    """Advance the equations to a time [s] or until the record is full; gives (the solver's code, number of rows).

    They are the very steps that `move` takes: each call of the solver takes one, and nothing is recorded inside it.
    """
    dynamics = inner(w, WORLD.dynamics)
    model, s, o, nothing = inner(dynamics, DYNAMICS.model), inner(dynamics, DYNAMICS.state), options_of(w), no_record(w)
    clock, counts, count = floats(s, STATE.clock), ints(s, STATE.counts), 1
    put_row(s, rows, 0)
    while clock[T] < stop and count < rows.shape[0]:
        most = min(counts[COUNTS.steps] + 1, o.max_steps)
        one = Options(o.rtol, o.atol, o.fixed_step, o.h_max, o.h_min, o.newton_tol, o.constraint_tol, most, o.method)
        before = counts[COUNTS.steps]
        code, _ = advance(model, s, one, stop, nothing, 0)
        if counts[COUNTS.steps] == before or (code != DONE and code != OUTCOME.too_many_steps):
            return code, count
        put_row(s, rows, count)
        count += 1
    return DONE, count


@compiled
def _put_step(s, d, rows, k):
    """The begin of the step to row k + 1 into the world s, and its end as a guess."""
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    q_before, v_before = floats(s, STATE.q_before), floats(s, STATE.v_before)
    end_q, end_v = floats(d, DIFFERENTIALS.end_q), floats(d, DIFFERENTIALS.end_v)
    lam, lam_before, mu = floats(s, STATE.lam), floats(s, STATE.lam_before), floats(s, STATE.mu)
    n, h = q.shape[0], rows[k + 1, 0] - rows[k, 0]
    for i in range(n):
        q[i] = q_before[i] = rows[k, 1 + i]
        v[i] = qd[i] = v_before[i] = rows[k, 1 + n + i]
        end_q[i], end_v[i] = rows[k + 1, 1 + i], rows[k + 1, 1 + n + i]
        vd[i] = (end_v[i] - v[i]) / h
    for i in range(lam.shape[0]):
        lam_before[i], mu[i] = lam[i], 0.0
    floats(s, STATE.clock)[T], floats(s, STATE.clock)[CLOCK.h_before] = rows[k, 0], 0.0
    ints(s, STATE.counts)[COUNTS.restart] = 0
    floats(d, DIFFERENTIALS.numbers)[NUMBERS.known] = 1.0
    return h


@compiled
def _differentiated(m, s, o, d, rows, k):
    """The step to row k + 1, solved again and differentiated; False where it cannot be."""
    if differentiated_step(m, s, o, d, _put_step(s, d, rows, k), KIND.sdirk2):
        return True
    # From afar: with accelerations that belong to its begin, and not from its recorded end.
    h = _put_step(s, d, rows, k)
    floats(d, DIFFERENTIALS.numbers)[NUMBERS.known] = 0.0
    set_inputs(m, s, rows[k, 0], False)
    return run_rates(m, s, SOLVER.consistent_rates, 0.0) and differentiated_step(m, s, o, d, h, KIND.sdirk2)


@compiled
def _put_ramps(c, ramps, first, t, row):
    """Columns of the values at both ends of each ramp: how much of either the input has at time t, and its rate."""
    du = matrix(c, COLUMNS.du)
    for i in range(ramps.shape[0]):
        k, length = int(ramps[i, RAMP.input]), ramps[i, RAMP.length]
        gone, column = (t - ramps[i, RAMP.begin]) / length, row + first + 2 * i
        du[column, 3 * k], du[column, 3 * k + 1] = 1.0 - gone, -1.0 / length
        du[column + 1, 3 * k], du[column + 1, 3 * k + 1] = gone, 1.0 / length


@compiled
def carry_steps(m, s, o, d, c, rows, count, ramps, first):
    """Carry all columns along the recorded steps; gives the number of those that could be solved again.

    Args:
        m: tables of the equations.
        s: a State beside that of the world, with the same inputs.
        o: options of the solver.
        d: Differentials of that state.
        c: Columns: states, then two for each ramp, then declared numbers.
        rows: the record.
        count: its number of rows.
        ramps: inputs that go linearly from one value to another, a row at the places of RAMP each.
        first: column of the first ramp.
    """
    columns = matrix(c, COLUMNS.dq).shape[0]
    for k in range(count - 1):
        # The first stage of a step has rows of its own, ahead of those of the second.
        _put_ramps(c, ramps, first, rows[k, 0] + GAMMA * (rows[k + 1, 0] - rows[k, 0]), 0)
        _put_ramps(c, ramps, first, rows[k + 1, 0], columns)
        if not _differentiated(m, s, o, d, rows, k):
            return k
        carry_forward(m, d, c)
    return count - 1

"""One control period of one world, compiled: from an action to an observation, a reward and what ended the episode.

    drive -> commands     patient -> excitations     DAE -> state     sensors -> readings -> observation, reward, events

The patient acts at ticks of its own clock, which may lie anywhere in the period; the equations are advanced from one
event, tick or end of the period, to the next. Inputs go linearly from what they were to their new values, so that the
drive's largest rates are true at all times and nothing jumps inside the solver. Drive and task are called by address; a
batch steps worlds in parallel without the Python lock.
"""

from __future__ import annotations

from dms_core.compiled.jit import compiled
from dms_core.kernels import (
    DONE,
    SIGNALS,
    STATE,
    Options,
    T,
    advance,
    call_with_table,
    floats,
    inner,
    ints,
    matrix,
    read_sensors,
)
from exo_env.patient.excitation.effort import TICK, EffortState, step_effort
from exo_env.tables import (
    DRIVE,
    DYNAMICS,
    EFFORT,
    FELT,
    OBSERVER,
    PATIENT_TABLES,
    PLAN,
    STATUS,
    TASK,
    WORLD,
)
from exo_env.tasks.task import SOLVER
from exo_env.world.kernels.load_step import put_load
from exo_env.world.kernels.observe import observe

SAME_TIME = 1e-6
"""Time by which two events may lie apart and still be one [s]: too short for a step of the solver."""


@compiled
def effort_of(w):
    """The `EffortState` of the patient."""
    e = inner(inner(w, WORLD.patient), PATIENT_TABLES.effort)
    return EffortState(
        floats(e, EFFORT.sign), floats(e, EFFORT.present), floats(e, EFFORT.active), floats(e, EFFORT.fatigued),
        matrix(e, EFFORT.command), matrix(e, EFFORT.drive), matrix(e, EFFORT.reflex), matrix(e, EFFORT.error),
        floats(e, EFFORT.limb), floats(e, EFFORT.levers), matrix(e, EFFORT.copy), matrix(e, EFFORT.expected),
        matrix(e, EFFORT.intents),
    )  # fmt: skip


@compiled
def ramp(state, row, value, period):
    """Let the input in a row of the signals go from what it is to `value` over the coming period."""
    signals = inner(state, STATE.signals)
    c, starts, t = matrix(signals, SIGNALS.c), floats(signals, SIGNALS.t), floats(state, STATE.clock)[T]
    now = c[row, 0] + c[row, 1] * (t - starts[row])
    starts[row] = t
    c[row, 0], c[row, 1] = now, (value - now) / period


@compiled
def set_commands(w):
    """Set the commands of the coming period, from the action.

    Only slopes of inputs jump, which nothing here reads: accelerations go on, and so does the method, which has no
    past.
    """
    drive, state = inner(w, WORLD.drive), inner(inner(w, WORLD.dynamics), DYNAMICS.state)
    period = floats(w, WORLD.period)[0]
    call_with_table(ints(drive, DRIVE.kernel)[0], w)
    wanted, commands, rows = floats(drive, DRIVE.wanted), floats(drive, DRIVE.commands), ints(drive, DRIVE.rows)
    steps = floats(drive, DRIVE.steps)
    for i in range(commands.shape[0]):
        commands[i] = min(max(wanted[i], commands[i] - steps[i]), commands[i] + steps[i])
        ramp(state, rows[i], commands[i], period)


@compiled
def set_excitations(w):
    """Let the patient act: set the excitations until the next tick, from what the patient wants and feels."""
    patient, state = inner(w, WORLD.patient), inner(inner(w, WORLD.dynamics), DYNAMICS.state)
    felt, ticks = floats(patient, PATIENT_TABLES.felt), ints(patient, PATIENT_TABLES.ticks)
    excitations, rows = floats(patient, PATIENT_TABLES.excitations), ints(patient, PATIENT_TABLES.rows)
    course, k = matrix(patient, PATIENT_TABLES.course), ticks[0]
    angle, rate, tremor = felt[FELT.angle], felt[FELT.rate], floats(inner(w, WORLD.observer), OBSERVER.tremor)
    step_effort(
        floats(patient, PATIENT_TABLES.traits), effort_of(w), TICK, matrix(patient, PATIENT_TABLES.wanted)[k + 1],
        course[k, 0] - angle, course[k, 1] - rate, angle, rate, tremor[k + 1], excitations,
    )  # fmt: skip
    for i in range(rows.shape[0]):
        ramp(state, rows[i], excitations[i], TICK)
    ticks[0] += 1


@compiled
def options_of(w):
    """Options of the solver."""
    o = floats(inner(w, WORLD.dynamics), DYNAMICS.options)
    return Options(o[0], o[1], o[2], o[3], o[4], o[5], o[6], int(o[7]), int(o[8]))


@compiled
def next_stop(w):
    """Time of the next event behind the present [s]: the patient's next tick, or the end of the period under way."""
    end = (ints(w, WORLD.status)[STATUS.step] + 1) * floats(w, WORLD.period)[0]
    tick = ints(inner(w, WORLD.patient), PATIENT_TABLES.ticks)[0] * TICK
    return tick if tick < end - SAME_TIME else end


@compiled
def move(w):
    """Advance the equations to the end of the period under way; gives the solver's code.

    Where the solver gave up and was helped to `next_stop`, this goes on from there.
    """
    dynamics, status = inner(w, WORLD.dynamics), ints(w, WORLD.status)
    period, ticks = floats(w, WORLD.period)[0], ints(inner(w, WORLD.patient), PATIENT_TABLES.ticks)
    start, end, nothing = status[STATUS.step] * period, (status[STATUS.step] + 1) * period, no_record(w)
    model, state = inner(dynamics, DYNAMICS.model), inner(dynamics, DYNAMICS.state)
    clock, code = floats(state, STATE.clock), DONE
    while code == DONE and clock[T] < end:
        if ticks[0] * TICK <= clock[T] + SAME_TIME:
            # At its beginning `read` has felt already.
            if clock[T] > start:
                sense(w)
            set_excitations(w)
        code, _ = advance(model, state, options_of(w), next_stop(w), nothing, 0)
    status[STATUS.code] = code
    return code


@compiled
def no_record(w):
    """A table without rows, for steps that are not recorded."""
    return matrix(inner(w, WORLD.plan), PLAN.course)[:0]


@compiled
def sense(w):
    """Read the sensors, and what the patient feels."""
    dynamics, patient = inner(w, WORLD.dynamics), inner(w, WORLD.patient)
    s, y = inner(dynamics, DYNAMICS.state), floats(dynamics, DYNAMICS.y)
    read_sensors(
        inner(dynamics, DYNAMICS.sensing), inner(s, STATE.signals), floats(s, STATE.clock)[T], floats(s, STATE.q),
        floats(s, STATE.v), floats(s, STATE.vd), floats(s, STATE.lam), False, y,
    )  # fmt: skip
    felt, senses = floats(patient, PATIENT_TABLES.felt), ints(patient, PATIENT_TABLES.senses)
    for i in range(senses.shape[0]):
        felt[i] = y[senses[i]]


@compiled
def read(w):
    """Read the sensors, what the patient feels and the readings of the task, at the control time `status.step`."""
    sense(w)
    task, y = inner(w, WORLD.task), floats(inner(w, WORLD.dynamics), DYNAMICS.y)
    r, source, target = floats(task, TASK.readings), ints(task, TASK.source), ints(task, TASK.target)
    for i in range(source.shape[0]):
        r[target[i]] = y[source[i]]
    call_with_table(ints(task, TASK.read)[0], w)


@compiled
def judge(w):
    """Set event and reward of the period that ends now."""
    task, status = inner(w, WORLD.task), ints(w, WORLD.status)
    if status[STATUS.code] != DONE:
        status[STATUS.event] = SOLVER
    call_with_table(ints(task, TASK.judge)[0], w)
    terms, weights, total = floats(task, TASK.terms), floats(task, TASK.weights), 0.0
    for i in range(weights.shape[0]):
        total += weights[i] * terms[i]
    floats(task, TASK.reward)[0] = total


@compiled
def finish(w):
    """Do what follows the solver; where it failed, readings and observation stay those of before."""
    status = ints(w, WORLD.status)
    status[STATUS.step] += 1
    if status[STATUS.code] == DONE:
        read(w)
        observe(w, False)
    judge(w)


@compiled
def run_period(w, action):
    """Do one control period with an action; gives the solver's code. Where it is not DONE, call `finish`."""
    drive = inner(w, WORLD.drive)
    now, before = floats(drive, DRIVE.action), floats(drive, DRIVE.before)
    for i in range(now.shape[0]):
        before[i] = now[i]
        now[i] = action[i]
    put_load(w)
    set_commands(w)
    code = move(w)
    if code == DONE:
        finish(w)
    return code


@compiled
def begin(w):
    """Fill readings and observation of the start."""
    read(w)
    observe(w, True)

"""One control period of one world, compiled: from an action to an observation, a reward and what ended the episode.

    patient -> excitations     drive -> commands     DAE -> state     sensors -> readings -> observation, reward, events

Inputs go linearly from what they were to their new values, so that the drive's largest rates are true at all times and
nothing jumps inside the solver. A world is a `Plant`: arrays only, packed (dms_core/compiled/arena.py), which a batch
steps in parallel without the Python lock.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.kernels import (
    DONE,
    SIGNALS,
    STATE,
    Options,
    Packed,
    T,
    advance,
    fields,
    floats,
    inner,
    ints,
    matrix,
    read_sensors,
)
from exo_env.jit import compiled
from exo_env.patient.effort import SIGN as FLEXION
from exo_env.patient.effort import STATE as EFFORT
from exo_env.patient.effort import N, samples_in, step_effort
from exo_env.tasks.limits import NOTHING, SOLVER, event_code
from exo_env.tasks.observer import TRUTH, imperfect
from exo_env.tasks.rewards import term_values


class Reading(NamedTuple):
    """Places of what follows from the sensors."""

    angle: int = 0
    """Of the elbow [rad]."""
    rate: int = 1
    """Of the elbow [rad/s]."""
    hinge: int = 2
    """Angle of the device [rad]."""
    hinge_rate: int = 3
    """[rad/s]"""
    agonist: int = 4
    """Tension [N], at least 0."""
    antagonist: int = 5
    """Tension [N], at least 0."""
    muscle_moment: int = 6
    """About the elbow [Nm]."""
    exo_moment: int = 7
    """Of the ropes about the hinge [Nm]."""
    reaction: int = 8
    """Size of the elbow's reaction force [N]."""
    guide: int = 9
    """Force of the guide on the forearm along the normal of its plane [N]."""
    share: int = 10
    """Of the device in the moment [-]."""
    error: int = 11
    """Elbow angle minus reference [rad]."""


class Status(NamedTuple):
    """Places of the counters."""

    step: int = 0
    """Control periods done."""
    code: int = 1
    """Of the solver (step_control.py)."""
    event: int = 2
    """What ended the episode (events.py)."""
    steps: int = 3
    """Control periods of the episode."""


READING, STATUS = Reading(), Status()


class Plant(NamedTuple):
    """A world with all that acts in a control period; n: components observed, k: control times."""

    model: Packed
    world: Packed
    sensing: Packed
    options: np.ndarray
    """Of the solver, in the order of `Options`."""
    patient: np.ndarray
    effort: np.ndarray
    period: np.ndarray
    """[s], shape (1,)."""
    wanted: np.ndarray
    """Motor command at each control time, (k, 6)."""
    course: np.ndarray
    """psi, its rate and acceleration, (k, 3)."""
    preview: np.ndarray
    lacking: np.ndarray
    scale: np.ndarray
    """Mean moment that is needed [Nm], shape (1,)."""
    noise: np.ndarray
    """Standard normal: first of the tremor, then of each component, (k, 1 + n)."""
    drive: np.ndarray
    """Offset and gain from an action to a command, and the command's largest change in a period, (2, 3)."""
    commands: np.ndarray
    """Reached at the end of the last period, (2,)."""
    excitations: np.ndarray
    stretch: np.ndarray
    inputs: np.ndarray
    """Rows of commands and excitations in the signals of the world, (8,)."""
    axes: np.ndarray
    """Of the worn device, (3, 3)."""
    places: np.ndarray
    """Of the sensors of `exo_env.world.readout.SENSORS`, muscle forces and activations in y."""
    y: np.ndarray
    reading: np.ndarray
    truth: np.ndarray
    """Every channel of every group [unit of the channel]."""
    columns: np.ndarray
    """Places in `truth` of what is observed, (n,)."""
    sensors: np.ndarray
    """Imperfections of each component, see observations.py, (n, 7)."""
    memory: np.ndarray
    observation: np.ndarray
    action: np.ndarray
    before: np.ndarray
    weights: np.ndarray
    limits: np.ndarray
    terms: np.ndarray
    reward: np.ndarray
    status: np.ndarray


PLANT = fields(Plant)


@compiled
def ramp(p, k, value):
    """Input k goes from what it is to `value` over the coming period."""
    world, period = inner(p, PLANT.world), floats(p, PLANT.period)[0]
    signals, row = inner(world, STATE.signals), ints(p, PLANT.inputs)[k]
    c, starts, t = matrix(signals, SIGNALS.c), floats(signals, SIGNALS.t), floats(world, STATE.clock)[T]
    now = c[row, 0] + c[row, 1] * (t - starts[row])
    starts[row] = t
    c[row, 0], c[row, 1] = now, (value - now) / period


@compiled
def set_inputs(p):
    """Commands and excitations of the coming period.

    Only their slopes jump, which nothing here reads: accelerations go on, and so does the method, which has no past.
    """
    action, drive, commands = floats(p, PLANT.action), matrix(p, PLANT.drive), floats(p, PLANT.commands)
    for i in range(2):
        wanted, change = drive[i, 0] + drive[i, 1] * action[i], drive[i, 2]
        commands[i] = min(max(wanted, commands[i] - change), commands[i] + change)
        ramp(p, i, commands[i])
    reading, status, period = floats(p, PLANT.reading), ints(p, PLANT.status), floats(p, PLANT.period)[0]
    stretch, excitations, k = floats(p, PLANT.stretch), floats(p, PLANT.excitations), status[STATUS.step]
    for i in range(N):
        stretch[i] = -FLEXION[i] * reading[READING.rate]
    step_effort(
        floats(p, PLANT.patient), floats(p, PLANT.effort), samples_in(period), period,
        matrix(p, PLANT.wanted)[k + 1], -reading[READING.error], stretch, matrix(p, PLANT.noise)[k + 1, 0], excitations,
    )  # fmt: skip
    for i in range(N):
        ramp(p, 2 + i, excitations[i])


@compiled
def options_of(p):
    """Options of the solver."""
    o = floats(p, PLANT.options)
    return Options(o[0], o[1], o[2], o[3], o[4], o[5], o[6], int(o[7]), int(o[8]))


@compiled
def move(p):
    """Advance the DAE to the end of the period under way; gives the solver's code."""
    status = ints(p, PLANT.status)
    end = (status[STATUS.step] + 1) * floats(p, PLANT.period)[0]
    nothing = matrix(p, PLANT.drive)[:0]
    code, _ = advance(inner(p, PLANT.model), inner(p, PLANT.world), options_of(p), end, nothing, 0)
    status[STATUS.code] = code
    return code


@compiled
def device_share(muscles, device):
    """What the device carries of the moment [Nm] that both give, from 0 to 1 [-]."""
    both = muscles + device
    if both == 0.0:
        return 0.0
    way = math.copysign(1.0, both)
    carried, own = max(way * device, 0.0), max(way * muscles, 0.0)
    return carried / (carried + own)


@compiled
def read(p):
    """Sensors of the world, and what follows from them, at the control time `status.step`."""
    world, y, r = inner(p, PLANT.world), floats(p, PLANT.y), floats(p, PLANT.reading)
    read_sensors(
        inner(p, PLANT.sensing), inner(world, STATE.signals), floats(world, STATE.clock)[T], floats(world, STATE.q),
        floats(world, STATE.v), floats(world, STATE.vd), floats(world, STATE.lam), False, y,
    )  # fmt: skip
    at, axes = ints(p, PLANT.places), matrix(p, PLANT.axes)
    for i in range(8):
        r[i] = y[at[i]]
    r[READING.agonist], r[READING.antagonist] = max(r[READING.agonist], 0.0), max(r[READING.antagonist], 0.0)
    r[READING.reaction] = math.sqrt(y[at[8]] ** 2 + y[at[9]] ** 2 + y[at[10]] ** 2)
    # The x axis of the lower link.
    c, s, guide = math.cos(r[READING.hinge]), math.sin(r[READING.hinge]), 0.0
    for i in range(3):
        guide += y[at[11 + i]] * (axes[i, 0] * c + axes[i, 1] * s)
    r[READING.guide] = guide
    r[READING.share] = device_share(r[READING.muscle_moment], r[READING.exo_moment])
    r[READING.error] = r[READING.angle] - matrix(p, PLANT.course)[ints(p, PLANT.status)[STATUS.step], 0]


@compiled
def observe(p, first):
    """The observation of the present readings; `first`: as if they had been true for long."""
    x, r, y, at = floats(p, PLANT.truth), floats(p, PLANT.reading), floats(p, PLANT.y), ints(p, PLANT.places)
    k, course = ints(p, PLANT.status)[STATUS.step], matrix(p, PLANT.course)
    x[TRUTH.angle], x[TRUTH.rate] = r[READING.hinge], r[READING.hinge_rate]
    x[TRUTH.tension], x[TRUTH.tension + 1] = r[READING.agonist], r[READING.antagonist]
    x[TRUTH.guide_force], x[TRUTH.reference], x[TRUTH.reference_rate] = r[READING.guide], course[k, 0], course[k, 1]
    preview, action, effort = matrix(p, PLANT.preview), floats(p, PLANT.action), floats(p, PLANT.effort)
    for i in range(preview.shape[1]):
        x[TRUTH.preview + i] = preview[k, i]
    for i in range(2):
        x[TRUTH.last_action + i] = action[i]
    for i in range(N):
        x[TRUTH.muscle_force + i], x[TRUTH.emg + i] = y[at[14 + i]], y[at[14 + N + i]]
        x[TRUTH.fatigued + i] = effort[EFFORT.fatigued + i]
    x[TRUTH.effort], x[TRUTH.device_share] = effort[EFFORT.effort], r[READING.share]
    imperfect(
        x, ints(p, PLANT.columns), matrix(p, PLANT.sensors), matrix(p, PLANT.memory), matrix(p, PLANT.noise)[k, 1:],
        first, floats(p, PLANT.observation),
    )  # fmt: skip


@compiled
def judge(p):
    """Event and reward of the period that ends now; gives the reward."""
    r, status, terms = floats(p, PLANT.reading), ints(p, PLANT.status), floats(p, PLANT.terms)
    if status[STATUS.code] != DONE:
        status[STATUS.event] = SOLVER
    else:
        status[STATUS.event] = event_code(
            floats(p, PLANT.limits), r[READING.angle], r[READING.agonist], r[READING.antagonist], r[READING.reaction]
        )
    term_values(
        r[READING.error], r[READING.exo_moment], floats(p, PLANT.lacking)[status[STATUS.step]],
        floats(p, PLANT.scale)[0], r[READING.reaction], floats(p, PLANT.action), floats(p, PLANT.before),
        status[STATUS.event] != NOTHING, terms,
    )  # fmt: skip
    weights, total = floats(p, PLANT.weights), 0.0
    for i in range(weights.shape[0]):
        total += weights[i] * terms[i]
    floats(p, PLANT.reward)[0] = total
    return total


@compiled
def finish(p):
    """What follows the solver: where it failed, readings and observation stay those of before."""
    status = ints(p, PLANT.status)
    status[STATUS.step] += 1
    if status[STATUS.code] == DONE:
        read(p)
        observe(p, False)
    return judge(p)


@compiled
def run_period(p, action):
    """One control period with an action; gives the solver's code. Where it is not DONE, call `finish`."""
    now, before = floats(p, PLANT.action), floats(p, PLANT.before)
    for i in range(2):
        before[i] = now[i]
        now[i] = action[i]
    set_inputs(p)
    code = move(p)
    if code == DONE:
        finish(p)
    return code


@compiled
def begin(p):
    """Readings and observation of the start."""
    read(p)
    observe(p, True)

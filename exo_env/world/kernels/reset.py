"""Compiled part of a reset: from a patient, a load and a movement to a world at rest and its first observation.

    key -> noise (streams.py)      sizes -> numbers of the world (scaling.py)      movement -> psi, preview
    arm, expected load -> command (patient/excitation/motor_command.py)      patient, load -> need (patient/ability.py)
    command -> activations, holding tension -> start (rest_pose.py) -> rates, readings

Patient, load and movement stand in `WorldTables.draw` before. Worlds are reset side by side without the Python lock,
as they are stepped.
"""

from __future__ import annotations

import math

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.kernels import (
    SIGNALS,
    STATE,
    call_with_table,
    constraint_gap,
    flags,
    floats,
    inner,
    ints,
    matrix,
    restart,
    rewind,
)
from dms_core.model.geometry.rotations import dot, vec
from exo_env.clearing import clear
from exo_env.drives.drive import start_apart
from exo_env.ecosystem.exoskeleton import link_moment, rope_lever
from exo_env.ecosystem.gym_machine import clearances
from exo_env.patient.ability import put_lacking
from exo_env.patient.excitation.effort import TICK, largest_activation, reset_effort, start_excitation
from exo_env.patient.excitation.forward_model import put_limb
from exo_env.patient.excitation.motor_command import RELAXATION_APART, SETTLED, SWEEPS
from exo_env.patient.excitation.static_optimisation import (
    ArmTable,
    LoadTable,
    interpolated,
    muscle_moment,
    needed_moment,
    needed_moments,
    planned,
)
from exo_env.patient.patient import PATIENT
from exo_env.streams import fill_normals
from exo_env.tables import (
    DRAW,
    DRIVE,
    DYNAMICS,
    ESTIMATOR,
    GIVEN,
    OBSERVER,
    OUTCOME,
    PATIENT_TABLES,
    PLAN,
    REST,
    SCALING,
    START,
    SUBJECT,
    TASK,
    WORLD,
)
from exo_env.tasks.movements.course import course_of
from exo_env.tasks.observation.noise import IMPERFECTION
from exo_env.world.kernels.control_period import begin, effort_of, options_of
from exo_env.world.kernels.load_step import CONSTRAINTS
from exo_env.world.kernels.rest_pose import MOVING, hinge_angle, hinge_transmission, put_rest
from exo_env.world.kernels.scaling import put_numbers

LEAST_CARRIED = 0.1
"""Moment [Nm] below which a unit of a command is no measure for what holds the arm: some 2 deg from a straight arm."""
STILL, BESIDE = 1e-9, 2
"""Rate of psi below which it rests [rad/s]; samples planned on either side of a movement."""
FIRST_STEP = 0.5
"""First step tried in an episode, over the control period: inputs leave rest along straight lines of that length."""
SAME_TIME = 1e-6
"""Part of a control period by which a time may lie before a control time and still be that time."""
CLOSED = 1e-10
"""Largest |phi| of a start [m or -], as in dms_core's assembly."""
BEGUN, PULLEY_IN_REACH, UNSETTLED, NO_RATES, GAPING = range(5)
"""Codes of what came of a reset: all went well; an end of the rope could come to a pulley; the command did not settle;
there are no accelerations; joints stay open."""


@compiled
def arm_of(w):
    """The `ArmTable` of the patient."""
    s, x = inner(w, WORLD.subject), inner(w, WORLD.scaling)
    return ArmTable(
        matrix(x, SCALING.muscles), floats(s, SUBJECT.sign), ints(s, SUBJECT.first), flags(s, SUBJECT.moving),
        matrix(x, SCALING.points), floats(s, SUBJECT.axis), floats(x, SCALING.elbow),
    )  # fmt: skip


@compiled
def load_of(w, weight):
    """The `LoadTable` of the patient with a weight [kg]."""
    s, x = inner(w, WORLD.subject), floats(inner(w, WORLD.scaling), SCALING.forearm)
    return LoadTable(
        x[0], x[1], x[2:5], x[5:8], floats(s, SUBJECT.handle)[0], weight, floats(s, SUBJECT.low_pulley),
        floats(s, SUBJECT.gravity),
    )  # fmt: skip


@compiled
def pulleys_out_of_reach(w, arm, load):
    """Whether neither end of the gym rope can come to a pulley."""
    s = inner(w, WORLD.subject)
    room, length = floats(s, SUBJECT.high_pulley)[1] - floats(s, SUBJECT.weight_height)[0], floats(s, SUBJECT.handle)[1]
    low, high, _ = clearances(vec(arm.elbow, 0), vec(load.grip, 0), length, vec(load.pulley, 0), room)
    return low > 0.0 and high > 0.0


@compiled
def draw_noise(w):
    """Draw the wandering of the tremor's phase, and the noise of what is observed and of what the device measures."""
    key = np.uint64(ints(inner(w, WORLD.draw), DRAW.key)[0])
    draw_noise_of(key, inner(w, WORLD.observer))
    draw_noise_of(key, inner(inner(w, WORLD.estimator), ESTIMATOR.sensors))


@compiled
def draw_noise_of(key, o):
    """Draw the noise of every component of an observer that has any, and of the tremor where the observer keeps it."""
    imperfections, noise, names = (
        matrix(o, OBSERVER.imperfections),
        matrix(o, OBSERVER.noise),
        ints(o, OBSERVER.streams),
    )
    fill_normals(key, np.uint64(names[0]), floats(o, OBSERVER.tremor))
    column = np.empty(noise.shape[0])
    for i in range(imperfections.shape[0]):
        if imperfections[i, IMPERFECTION.deviation] > 0.0:
            fill_normals(key, np.uint64(names[1 + i]), column)
            for k in range(column.shape[0]):
                noise[k, i] = column[k]


@compiled
def put_course(w):
    """Put the movement into the signal of psi, its course and its preview, and the weight at each control time."""
    plan, period = inner(w, WORLD.plan), floats(w, WORLD.period)[0]
    movement, drawn_movement = floats(plan, PLAN.movement), floats(inner(w, WORLD.draw), DRAW.movement)
    for i in range(movement.shape[0]):
        movement[i] = drawn_movement[i]
    floats(plan, PLAN.loads)[:] = floats(inner(w, WORLD.draw), DRAW.given)[GIVEN.load]
    call_with_table(ints(plan, PLAN.kernel)[0], w)
    t, c, course = floats(plan, PLAN.starts), matrix(plan, PLAN.coefficients), matrix(plan, PLAN.course)
    preview, horizons, n = matrix(plan, PLAN.preview), floats(plan, PLAN.horizons), course.shape[0]
    times, ahead = np.empty(n), np.empty((n, 3))
    for k in range(n):
        times[k] = k * period
    course_of(t, c, times, course)
    last = times[n - 1]
    for i in range(horizons.shape[0]):
        for k in range(n):
            times[k] = min(k * period + horizons[i], last)
        course_of(t, c, times, ahead)
        for k in range(n):
            preview[k, i] = ahead[k, 0]


@compiled
def put_command(w, arm, load, expected):
    """Fill the motor command and psi at each tick of the patient; gives the estimated error in an activation.

    A long rest is planned once.

    Args:
        w: the packed world.
        arm: an ArmTable.
        load: a LoadTable.
        expected: weight that the patient expects over the real one [-].
    """
    plan, times, moves = inner(w, WORLD.plan), floats(inner(w, WORLD.subject), SUBJECT.times), False
    n, loads, period = times.shape[0], floats(plan, PLAN.loads), floats(w, WORLD.period)[0]
    course, row, weights = np.empty((n, 3)), np.zeros(n, np.int64), np.empty(n)
    course_of(floats(plan, PLAN.starts), matrix(plan, PLAN.coefficients), times, course)
    for k in range(n):
        weights[k] = expected * loads[min(int(times[k] / period + SAME_TIME), loads.shape[0] - 1)]
    for k in range(n):
        if abs(course[k, 1]) > STILL or weights[k] != weights[max(k - 1, 0)]:
            moves = True
            for i in range(max(k - BESIDE, 0), min(k + BESIDE + 1, n)):
                row[i] = 1
    count = 0
    for k in range(n):
        if row[k] == 1 or (not moves and k < BESIDE):
            course[count], weights[count] = course[k], weights[k]
            count += 1
        row[k] = max(count - 1, 0)
    moment, activations = np.empty(count), np.empty((count, arm.sign.shape[0]))
    needed_moments(arm, load, weights[:count], course[:count], moment)
    _, left = planned(arm, times[1], course[:count], moment, SWEEPS, RELAXATION_APART, SETTLED, activations)
    put_ticks(w, activations, row, times[1])
    return left


@compiled
def put_ticks(w, activations, row, interval):
    """Fill what the patient wants at each tick, from a table of activations at an interval [s], and psi there."""
    patient, plan = inner(w, WORLD.patient), inner(w, WORLD.plan)
    wanted, course = matrix(patient, PATIENT_TABLES.wanted), matrix(patient, PATIENT_TABLES.course)
    interpolated(activations, row, interval, TICK, wanted)
    times = np.empty(course.shape[0])
    for k in range(times.shape[0]):
        times[k] = k * TICK
    course_of(floats(plan, PLAN.starts), matrix(plan, PLAN.coefficients), times, course)


@compiled
def mean_command(w, traits):
    """Mean activation of each muscle that a patient can give to the command [-], shape (m,)."""
    wanted, sign = matrix(inner(w, WORLD.patient), PATIENT_TABLES.wanted), floats(inner(w, WORLD.subject), SUBJECT.sign)
    mean = np.zeros(sign.shape[0])
    for i in range(sign.shape[0]):
        most = largest_activation(traits, sign[i])
        for k in range(wanted.shape[0]):
            mean[i] += min(wanted[k, i], most) / wanted.shape[0]
    return mean


@compiled
def put_patient(w, arm, load, activations):
    """Put traits, need and effort of the patient in their places; fills the activations of the start, shape (m,)."""
    draw, patient, plan = inner(w, WORLD.draw), inner(w, WORLD.patient), inner(w, WORLD.plan)
    row, traits = floats(draw, DRAW.patient), floats(patient, PATIENT_TABLES.traits)
    for k in range(traits.shape[0]):
        traits[k] = row[k]
    task = inner(w, WORLD.task)
    readings, shown = floats(task, TASK.readings), inner(task, TASK.shown)
    for k in range(shown.shape[0]):
        readings[shown[k, 0]] = row[shown[k, 1]]
    link = floats(inner(w, WORLD.subject), SUBJECT.link)
    ability, scale = put_lacking(
        traits, arm, load, floats(plan, PLAN.loads), link, matrix(plan, PLAN.course), floats(plan, PLAN.needed),
        floats(plan, PLAN.able), floats(plan, PLAN.lacking),
    )  # fmt: skip
    floats(w, WORLD.outcome)[OUTCOME.ability], floats(plan, PLAN.scale)[0] = ability, scale
    effort, wanted = effort_of(w), matrix(patient, PATIENT_TABLES.wanted)[0]
    given, constants = floats(draw, DRAW.given), floats(inner(w, WORLD.scaling), SCALING.constants)
    expected = load_of(w, traits[PATIENT.expected_load] * given[GIVEN.load])
    put_limb(traits, arm, expected, constants, mean_command(w, traits), effort.limb, effort.levers)
    reset_effort(traits, effort, TICK, wanted, given[GIVEN.start], given[GIVEN.phase])
    for k in range(activations.shape[0]):
        activations[k] = start_excitation(effort, k)


@compiled
def put_inputs(w, arm, load, activations):
    """Hold the inputs until the first control period: activations, and commands that hold the arm where they can."""
    subject, drive, g = inner(w, WORLD.subject), inner(w, WORLD.drive), vec(load.gravity, 0)
    angle, ends = floats(inner(w, WORLD.draw), DRAW.given)[GIVEN.start], matrix(subject, SUBJECT.rope)
    needed = needed_moment(arm, load, angle, 0.0, 0.0)
    hinge, transmission = hinge_angle(w, arm, angle), hinge_transmission(w, arm, angle)
    needed += transmission * link_moment(floats(subject, SUBJECT.link), hinge, math.sqrt(dot(g, g)))
    lever = rope_lever(ends[0], ends[1], hinge)
    tension = (needed - muscle_moment(arm, angle, activations)) / (transmission * lever)
    signals = inner(inner(inner(w, WORLD.dynamics), DYNAMICS.state), STATE.signals)
    commands, start, rows = floats(drive, DRIVE.commands), matrix(drive, DRIVE.start), ints(drive, DRIVE.rows)
    apart = start_apart(w)
    for i in range(commands.shape[0]):
        unit = tension_of(start, i, hinge, lever)
        held = max(tension, 0.0) / unit if unit > 0.0 else 0.0
        commands[i] = start[START.always, i] + min(held, start[START.holds, i]) + start[START.apart, i] * apart
        hold(signals, rows[i], commands[i])
    rows = ints(inner(w, WORLD.patient), PATIENT_TABLES.rows)
    for i in range(rows.shape[0]):
        hold(signals, rows[i], activations[i])


@compiled
def tension_of(start, i, hinge, lever):
    """Tension of the lifting rope that a unit of command i stands for [N]: 1 where the command is a tension itself.

    Near a straight arm, where a unit carries less than LEAST_CARRIED, it is 0: the command then holds nothing.

    Args:
        start: the table of the commands' start.
        i: number of the command.
        hinge: angle of the hinge [rad].
        lever: moment arm of the rope there [m].
    """
    by_cos, by_sin = start[START.carried_cos, i], start[START.carried_sin, i]
    if by_cos == 0.0 and by_sin == 0.0:
        return 1.0
    moment = by_cos * math.cos(hinge) + by_sin * math.sin(hinge)
    return moment / lever if moment > LEAST_CARRIED else 0.0


@compiled
def hold(signals, row, value):
    """Let the input in a row of the signals keep a value."""
    c = matrix(signals, SIGNALS.c)
    floats(signals, SIGNALS.t)[row], c[row] = 0.0, 0.0
    c[row, 0] = value


@compiled
def put_world(w, arm, load, activations):
    """Put the world at rest at its start, without accelerations."""
    scaling, rest, drive = inner(w, WORLD.scaling), inner(w, WORLD.rest), inner(w, WORLD.drive)
    subject = inner(w, WORLD.subject)
    q, v, psi = floats(scaling, SCALING.start), floats(rest, REST.v), matrix(inner(w, WORLD.plan), PLAN.course)[0, 0]
    angle = floats(inner(w, WORLD.draw), DRAW.given)[GIVEN.start]
    rope = put_rest(w, arm, load, angle, psi, activations, q, v)
    floats(inner(scaling, SCALING.targets), CONSTRAINTS)[ints(rest, REST.rope)[0]] = rope
    motors, commands = inner(drive, DRIVE.motors), floats(drive, DRIVE.commands)
    start, ends, hinge = matrix(drive, DRIVE.start), matrix(subject, SUBJECT.rope), hinge_angle(w, arm, angle)
    lever = rope_lever(ends[0], ends[1], hinge)
    for k in range(motors.shape[0]):
        q[motors[k, 0]] = commands[motors[k, 1]] * tension_of(start, motors[k, 1], hinge, lever)
    # The controller's error counts what it adds to psi.
    offset, pid = ints(rest, REST.offset), ints(rest, REST.places)[MOVING.pid]
    for k in range(offset.shape[0]):
        v[pid] += q[offset[k]]
    rewind(inner(inner(w, WORLD.dynamics), DYNAMICS.state), q, v, FIRST_STEP * floats(w, WORLD.period)[0])


@compiled
def settle(w):
    """Solve for accelerations and multipliers of a world at its start, and observe it; gives what came of it."""
    dynamics = inner(w, WORLD.dynamics)
    m, s = inner(dynamics, DYNAMICS.model), inner(dynamics, DYNAMICS.state)
    if not restart(m, s, options_of(w)):
        return NO_RATES
    gap = constraint_gap(m, s)
    floats(w, WORLD.outcome)[OUTCOME.gap] = gap
    if not gap <= CLOSED:
        return GAPING
    begin(w)
    return BEGUN


@compiled
def begin_drawn(w):
    """Begin the episode whose numbers, those of the noise included, are in their places; gives what came of it."""
    draw = inner(w, WORLD.draw)
    put_numbers(w, floats(draw, DRAW.given)[GIVEN.load])
    weight = floats(draw, DRAW.given)[GIVEN.load]
    arm, load = arm_of(w), load_of(w, weight)
    activations = np.empty(arm.sign.shape[0])
    if not pulleys_out_of_reach(w, arm, load):
        return PULLEY_IN_REACH
    put_course(w)
    left = put_command(w, arm, load, floats(draw, DRAW.patient)[PATIENT.expected_load])
    floats(w, WORLD.outcome)[OUTCOME.left] = left
    if not left < SETTLED:
        return UNSETTLED
    put_patient(w, arm, load, activations)
    put_inputs(w, arm, load, activations)
    put_world(w, arm, load, activations)
    return settle(w)


@compiled(nogil=True)
def begin_episode(w):
    """Clear the world and begin the episode that `WorldTables.draw` describes; gives what came of it."""
    clear(inner(w, WORLD.cleared))
    draw_noise(w)
    return begin_drawn(w)

"""Compiled opening of an episode: from a patient, a weight and a movement to a world at rest and its first observation.

    sizes -> numbers of the world (fitting.py)      movement -> reference, preview      arm, expected load -> command
    patient, load -> need      command -> activations, holding tension -> start (start_kernel.py) -> rates, readings

All arrays belong to a `Rig`; who is in it and what is lifted is written into a `Setting` before. Worlds open side by
side without the Python lock, as they are stepped.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.kernels import SIGNALS, STATE, fields, flags, floats, inner, ints, matrix, restart, rewind
from dms_core.model.geometry.rotations import dot, vec
from dms_core.simulation.newton import largest_errors
from dms_core.simulation.parts import PARTS, run_part
from exo_env.ecosystem.exoskeleton import link_moment, rope_lever
from exo_env.ecosystem.gym_machine import clearances
from exo_env.jit import compiled
from exo_env.patient.ability import put_lacking
from exo_env.patient.effort import N, reset_effort, samples_in, start_excitation
from exo_env.patient.motor_command import SETTLED, SWEEPS
from exo_env.patient.patient import FIELDS, PATIENT
from exo_env.patient.static_optimisation import ArmTable, LoadTable, drawn, muscle_moment, needed_moment, planned
from exo_env.tasks.movement import course_of, put_pieces
from exo_env.tasks.observer import OF_PATIENT, PREVIEW, TRUTH
from exo_env.world.control_period import PLANT, STATUS, begin, options_of
from exo_env.world.rest_pose import Hardware, Places, put_start
from exo_env.world.scaling import MONOMIALS, put_monomials

STILL, BESIDE = 1e-9, 2
"""Rate of the reference below which it rests [rad/s]; samples planned on either side of a movement."""
RELAXATION = 0.6
"""As in motor_command.py: samples PLANNING apart (rig.py) do not excite each other."""
FIRST_STEP = 0.5
"""First step tried in an episode, over the control period: inputs leave rest along straight lines of that length."""
CLOSED = 1e-10
"""Largest |phi| of a start [m or -], as in dms_core's assembly."""
OPEN, PULLEY_IN_REACH, UNSETTLED, NO_RATES, GAPING = range(5)
"""What came of an opening: all went well; the rope's end could come to a pulley; the command did not settle; there are
no accelerations; joints stay open."""
PICKED = np.array([FIELDS.index(name) for name in PATIENT._fields])
"""Place of each number that the effort reads in a patient's row."""
TOLD = np.array([(place, FIELDS.index(name)) for place, name in OF_PATIENT])
"""Place of each number that a privileged observer is told in the truth, and in a patient's row."""
MASS, HEIGHT, SEX, STRENGTH, RISE, FALL, EXPECTED = (
    FIELDS.index(name)
    for name in ("body_mass", "height", "sex", "strength", "activation_time_scale", "deactivation_time_scale",
                 "expected_load")
)  # fmt: skip


class Given(NamedTuple):
    """Places in `Setting.given`."""

    weight: int = 0
    """On the machine [kg]."""
    angle: int = 1
    """Of the elbow at the start [rad]."""
    phase: int = 2
    """Of the tremor [rad]."""


class Found(NamedTuple):
    """Places in `Setting.found`."""

    ability: int = 0
    """See need.py [-]."""
    left: int = 1
    """Estimated error in an activation of the command [-]."""
    gap: int = 2
    """Largest |phi| at the start [m or -]."""


GIVEN, FOUND = Given(), Found()


class Setting(NamedTuple):
    """What an opening reads beside the plant."""

    patient: np.ndarray
    """In the order of FIELDS."""
    movement: np.ndarray
    """In the order of MOVEMENT."""
    given: np.ndarray
    found: np.ndarray
    coefficients: np.ndarray
    """C of fitting.py for men, then for women, (2 n, MONOMIALS)."""
    constants: np.ndarray
    """Time constants of activation and deactivation of a muscle [s], (2,)."""
    numbers: np.ndarray
    """C phi: those of the model, then what follows, which are views of it, (n,)."""
    start: np.ndarray
    """Coordinates; true for what does not move."""
    muscles: np.ndarray
    points: np.ndarray
    elbow: np.ndarray
    forearm: np.ndarray
    targets: np.ndarray
    """Where the model's numbers lie: a table as of arena.py, (k, 3)."""
    rope: np.ndarray
    """Place of the gym rope's length in the second of them, (1,)."""
    first: np.ndarray
    moving: np.ndarray
    axis: np.ndarray
    """The rest of an ArmTable."""
    gravity: np.ndarray
    link: np.ndarray
    link_centre: np.ndarray
    handle: np.ndarray
    low_pulley: np.ndarray
    high_pulley: np.ndarray
    weight_height: np.ndarray
    """As in Hardware; the last of shape (1,)."""
    lower_link: np.ndarray
    """Mass and centre of mass, (4,)."""
    agonist: np.ndarray
    """Ends of the rope on upper and lower link [m], (2, 3)."""
    holding: np.ndarray
    """Of the drive, (2, 2)."""
    motors: np.ndarray
    """Coordinate of each motor that follows a command, and the command's number, (k, 2)."""
    places: np.ndarray
    """Of Places, but for the muscles, (5,)."""
    fibres: np.ndarray
    reference: np.ndarray
    """First piece of the reference in the signals, and the one behind its last, (2,)."""
    times: np.ndarray
    """At which the command is planned [s]."""
    v: np.ndarray
    """Rates at the start, 0 but for the controller's."""


SETTING = fields(Setting)


@compiled
def put_numbers(s):
    """Sizes of a patient, and the weight, into the numbers of the world."""
    who, times, phi = floats(s, SETTING.patient), floats(s, SETTING.constants), np.empty(MONOMIALS)
    put_monomials(
        who[MASS], who[HEIGHT], who[STRENGTH], floats(s, SETTING.given)[GIVEN.weight], who[RISE] * times[0],
        who[FALL] * times[1], phi,
    )  # fmt: skip
    C, x, targets = matrix(s, SETTING.coefficients), floats(s, SETTING.numbers), inner(s, SETTING.targets)
    first, at = int(who[SEX]) * x.shape[0], 0
    for i in range(x.shape[0]):
        total = 0.0
        for j in range(MONOMIALS):
            total += C[first + i, j] * phi[j]
        x[i] = total
    for k in range(targets.shape[0]):
        into = floats(targets, k)
        for i in range(into.shape[0]):
            into[i] = x[at + i]
        at += into.shape[0]


@compiled
def arm_of(s):
    """The patient's ArmTable."""
    return ArmTable(
        matrix(s, SETTING.muscles), ints(s, SETTING.first), flags(s, SETTING.moving), matrix(s, SETTING.points),
        floats(s, SETTING.axis), floats(s, SETTING.elbow),
    )  # fmt: skip


@compiled
def load_of(s, weight):
    """The patient's LoadTable with a weight [kg]."""
    x = floats(s, SETTING.forearm)
    return LoadTable(
        x[0], x[1], x[2:5], x[5:8], floats(s, SETTING.handle)[0], weight, floats(s, SETTING.low_pulley),
        floats(s, SETTING.gravity),
    )  # fmt: skip


@compiled
def put_course(p, s):
    """The movement into the signal of the reference, into its course and its preview."""
    signals, rows = inner(inner(p, PLANT.world), STATE.signals), ints(s, SETTING.reference)
    t, c = floats(signals, SIGNALS.t)[rows[0] : rows[1]], matrix(signals, SIGNALS.c)[rows[0] : rows[1]]
    put_pieces(floats(s, SETTING.movement), t, c)
    course, preview, period = matrix(p, PLANT.course), matrix(p, PLANT.preview), floats(p, PLANT.period)[0]
    n = course.shape[0]
    times, ahead = np.empty(n), np.empty((n, 3))
    for k in range(n):
        times[k] = k * period
    course_of(t, c, times, course)
    last = times[n - 1]
    for i in range(len(PREVIEW)):
        for k in range(n):
            times[k] = min(k * period + PREVIEW[i], last)
        course_of(t, c, times, ahead)
        for k in range(n):
            preview[k, i] = ahead[k, 0]


@compiled
def put_command(p, s, arm, load):
    """What the patient wants at each control time; gives the estimated error in an activation.

    What rests for long is planned once.
    """
    signals, rows = inner(inner(p, PLANT.world), STATE.signals), ints(s, SETTING.reference)
    t, c = floats(signals, SIGNALS.t)[rows[0] : rows[1]], matrix(signals, SIGNALS.c)[rows[0] : rows[1]]
    times, moves = floats(s, SETTING.times), False
    n = times.shape[0]
    course, row = np.empty((n, 3)), np.zeros(n, np.int64)
    course_of(t, c, times, course)
    for k in range(n):
        if abs(course[k, 1]) > STILL:
            moves = True
            for i in range(max(k - BESIDE, 0), min(k + BESIDE + 1, n)):
                row[i] = 1
    count = 0
    for k in range(n):
        if row[k] == 1 or (not moves and k < BESIDE):
            course[count] = course[k]
            count += 1
        row[k] = max(count - 1, 0)
    moment, activations = np.empty(count), np.empty((count, N))
    _, left = planned(arm, load, times[1], course[:count], SWEEPS, RELAXATION, SETTLED, moment, activations)
    drawn(activations, row, times[1], floats(p, PLANT.period)[0], matrix(p, PLANT.wanted))
    return left


@compiled
def put_patient(p, s, arm, load, activations):
    """Patient and need into the plant, all else of the last episode out of it; activations at the start are filled."""
    for k in (PLANT.excitations, PLANT.stretch, PLANT.y, PLANT.reading, PLANT.action, PLANT.before, PLANT.terms,
              PLANT.reward, PLANT.truth):  # fmt: skip
        floats(p, k)[:] = 0.0
    matrix(p, PLANT.memory)[:] = 0.0
    ints(p, PLANT.status)[: STATUS.steps] = 0
    who, patient, truth = floats(s, SETTING.patient), floats(p, PLANT.patient), floats(p, PLANT.truth)
    for k in range(patient.shape[0]):
        patient[k] = who[PICKED[k]]
    for k in range(TOLD.shape[0]):
        truth[TOLD[k, 0]] = who[TOLD[k, 1]]
    truth[TRUTH.load] = load.weight
    ability, scale = put_lacking(
        patient, arm, load, floats(s, SETTING.lower_link), matrix(p, PLANT.course), floats(p, PLANT.lacking)
    )
    floats(s, SETTING.found)[FOUND.ability], floats(p, PLANT.scale)[0] = ability, scale
    period, effort = floats(p, PLANT.period)[0], floats(p, PLANT.effort)
    samples, phase = samples_in(period), floats(s, SETTING.given)[GIVEN.phase]
    reset_effort(patient, effort, samples, period, matrix(p, PLANT.wanted)[0], phase)
    for k in range(N):
        activations[k] = start_excitation(effort, samples, k)


@compiled
def put_inputs(p, s, arm, load, activations):
    """Inputs at rest until the first control period: activations, and commands that hold the arm where they can."""
    angle, ends, g = floats(s, SETTING.given)[GIVEN.angle], matrix(s, SETTING.agonist), vec(load.gravity, 0)
    needed = needed_moment(arm, load, angle, 0.0, 0.0)
    needed += link_moment(floats(s, SETTING.lower_link), angle, math.sqrt(dot(g, g)))
    tension = (needed - muscle_moment(arm, angle, activations)) / rope_lever(ends[0], ends[1], angle)
    signals, rows = inner(inner(p, PLANT.world), STATE.signals), ints(p, PLANT.inputs)
    t, c, commands, holding = (
        floats(signals, SIGNALS.t), matrix(signals, SIGNALS.c), floats(p, PLANT.commands), matrix(s, SETTING.holding),
    )  # fmt: skip
    for i in range(commands.shape[0]):
        commands[i] = holding[0, i] + min(max(tension, 0.0), holding[1, i])
    for i in range(rows.shape[0]):
        t[rows[i]], c[rows[i]] = 0.0, 0.0
        c[rows[i], 0] = commands[i] if i < commands.shape[0] else activations[i - commands.shape[0]]


@compiled
def put_world(p, s, arm, load, activations):
    """The world at rest at its start, without accelerations."""
    at = ints(s, SETTING.places)
    hardware = Hardware(
        floats(s, SETTING.link), floats(s, SETTING.link_centre), floats(s, SETTING.handle),
        floats(s, SETTING.low_pulley), floats(s, SETTING.high_pulley), floats(s, SETTING.weight_height)[0],
    )  # fmt: skip
    places = Places(at[0], at[1], at[2], at[3], at[4], ints(s, SETTING.fibres))
    q, v, psi = floats(s, SETTING.start), floats(s, SETTING.v), matrix(p, PLANT.course)[0, 0]
    rope = put_start(arm, load, hardware, places, floats(s, SETTING.given)[GIVEN.angle], psi, activations, q, v)
    floats(inner(s, SETTING.targets), 1)[ints(s, SETTING.rope)[0]] = rope
    motors, commands = inner(s, SETTING.motors), floats(p, PLANT.commands)
    for k in range(motors.shape[0]):
        q[motors[k, 0]] = commands[motors[k, 1]]
    rewind(inner(p, PLANT.world), q, v, FIRST_STEP * floats(p, PLANT.period)[0])


@compiled
def settle(p, s):
    """Accelerations and multipliers of a world at its start, and the first observation; gives what came of it."""
    w, m = inner(p, PLANT.world), inner(p, PLANT.model)
    if not restart(m, w, options_of(p)):
        return NO_RATES
    run_part(m, w, PARTS.constraints)
    gap = largest_errors(w)[0]
    floats(s, SETTING.found)[FOUND.gap] = gap
    if not gap <= CLOSED:
        return GAPING
    begin(p)
    return OPEN


@compiled(nogil=True)
def open_episode(p, s):
    """Open the episode that a packed Setting s describes, in a packed Plant p; gives what came of it."""
    put_numbers(s)
    weight = floats(s, SETTING.given)[GIVEN.weight]
    arm, load, activations = arm_of(s), load_of(s, weight), np.empty(N)
    room, length = floats(s, SETTING.high_pulley)[1] - floats(s, SETTING.weight_height)[0], floats(s, SETTING.handle)[1]
    low, high, _ = clearances(vec(arm.elbow, 0), vec(load.grip, 0), length, vec(load.pulley, 0), room)
    if not (low > 0.0 and high > 0.0):
        return PULLEY_IN_REACH
    put_course(p, s)
    left = put_command(p, s, arm, load_of(s, floats(s, SETTING.patient)[EXPECTED] * weight))
    floats(s, SETTING.found)[FOUND.left] = left
    if not left < SETTLED:
        return UNSETTLED
    put_patient(p, s, arm, load, activations)
    put_inputs(p, s, arm, load, activations)
    put_world(p, s, arm, load, activations)
    return settle(p, s)

"""The arrays of one world and of what acts on it, by owner, as compiled code is handed them.

A world is one packed `WorldTables` w (dms_core/compiled/arena.py); kernels take views by name:

    readings = floats(inner(w, WORLD.task), TASK.readings)

Each field says whether a reset keeps, fills or clears its array (clearing.py).
"""

from __future__ import annotations

from typing import NamedTuple

from dms_core.kernels import Packed, fields
from exo_env.clearing import Cleared, Filled, Kept
from exo_env.patient.excitation.effort import EffortState
from exo_env.places import places

STATUS = places(("step", "code", "event"))
"""Places in `WorldTables.status`: control periods done, code of the solver, event that ended the episode."""
GIVEN = places(("load", "start", "phase"))
"""Places in `DrawTables.given`: weight on the machine [kg], elbow angle and phase of the tremor at the start [rad]."""
START = places(("always", "holds", "apart", "carried_cos", "carried_sin"))
"""Places in a column of `DriveTables.start`: the value of a command, the most that it takes of what holds the arm, what
it has for each radian by which the arm begins beyond psi, and the moment that a unit of it gives, as m_c and m_s [Nm],
zeros where it is a tension of its own [N]."""
FELT = places(("angle", "rate"))
"""Places in `PatientTables.felt`: angle [rad] and rate [rad/s] of the elbow."""
OUTCOME = places(("ability", "left", "gap"))
"""Places in `WorldTables.outcome`: ability [-], estimated error in an activation of the command [-], largest |phi| at
the start [m or -]."""


class DynamicsTables(NamedTuple):
    """The differential-algebraic system and its sensors."""

    model: Packed
    """Tables of the equations (dms_core)."""
    state: Packed
    """Arrays of the simulation (dms_core)."""
    sensing: Packed
    """Tables of the sensors (dms_core)."""
    options: Kept
    """Options of the solver, in the order of `Options`."""
    y: Cleared
    """All sensors of the model."""


class DriveTables(NamedTuple):
    """From n_a actions to n_c commands; see drives/drive.py."""

    kernel: Kept
    """Address of the drive's kernel, shape (1,)."""
    numbers: Kept
    """Numbers of the drive that the kernel reads beside the action."""
    steps: Kept
    """Largest change of each command in a control period, shape (n_c,)."""
    start: Kept
    """What each command is at the start, at the places of START, shape (5, n_c)."""
    motors: Kept
    """Coordinate of each motor or filter that follows a command, and the command's number, shape (k, 2)."""
    rows: Kept
    """Row of each command in the signals of the world, shape (n_c,)."""
    hinge: Kept
    """Place in y of the angle that the device measures at its hinge, shape (1,)."""
    axes: Kept
    """Axes of both links where the hinge is at 0, as columns in ground axes, shape (3, 3)."""
    action: Cleared
    """The present action, shape (n_a,)."""
    before: Cleared
    """The action of the period before, shape (n_a,)."""
    wanted: Cleared
    """What each command is to be at the end of the period, from the kernel, shape (n_c,)."""
    commands: Cleared
    """Commands that were reached at the end of the last period, shape (n_c,)."""


class PatientTables(NamedTuple):
    """The patient in the device, acting at ticks of a clock of its own (excitation/effort.py); m muscles, k ticks."""

    traits: Cleared
    """Numbers of the patient, at the places of PATIENT."""
    effort: EffortState
    """Effort, fatigue and the memories of delayed signals."""
    ticks: Cleared
    """Number of times that the patient has acted, shape (1,)."""
    wanted: Cleared
    """Motor command at each tick, shape (k, m)."""
    course: Cleared
    """psi, its rate and its acceleration at each tick, shape (k, 3)."""
    excitations: Cleared
    """Excitation of each muscle at the next tick [-], shape (m,)."""
    felt: Cleared
    """What the patient feels of the elbow, at the places of FELT."""
    senses: Kept
    """Places in y of the sensors that give it."""
    rows: Kept
    """Row of each excitation in the signals of the world, shape (m,)."""


class PlanTables(NamedTuple):
    """The movement that the patient intends, and the moment that it needs; k control times."""

    kernel: Kept
    """Address of the movement's kernel, shape (1,)."""
    movement: Cleared
    """Numbers of the movement."""
    starts: Filled
    """Starts of the pieces of psi in the signals of the world [s]."""
    coefficients: Filled
    """Coefficients of these pieces, shape (n, 6)."""
    course: Cleared
    """psi, its rate and its acceleration at each control time, shape (k, 3)."""
    horizons: Kept
    """How far ahead the reference is shown [s]."""
    preview: Cleared
    """psi that far ahead at each control time, shape (k, n)."""
    loads: Filled
    """Weight on the machine at each control time [kg], shape (k,)."""
    needed: Filled
    """Moment that arm and load need along psi at each control time [Nm], shape (k,)."""
    able: Filled
    """Moment that a patient, as fatigued as at the start, can give over that which holds arm and load, at each control
    time [-], shape (k,)."""
    lacking: Cleared
    """What the patient cannot give of the needed moment at each control time [Nm], shape (k,)."""
    scale: Cleared
    """Mean moment that is needed [Nm], shape (1,)."""


class TaskTables(NamedTuple):
    """Readings, reward terms and limits of the task; see tasks/task.py."""

    read: Kept
    """Address of the kernel `read`, shape (1,)."""
    judge: Kept
    """Address of the kernel `judge`, shape (1,)."""
    first: Kept
    """Place of the first component of each reading, in the order of the task's readings, shape (n,)."""
    source: Kept
    """Places in y of the sensors that readings copy."""
    target: Kept
    """Place in the readings of each of these."""
    shown: Kept
    """Place in the readings, and in a patient's row, of each trait that a reading shows, shape (k, 2)."""
    numbers: Kept
    """Numbers of the task that the kernels read: its limits, and what else it has."""
    weights: Kept
    """Weight of each reward term."""
    readings: Cleared
    """Components of all readings, one behind the other."""
    terms: Cleared
    """Value of each reward term, shape (n,)."""
    reward: Cleared
    """Sum of the terms times their weights, shape (1,)."""


class ObserverTables(NamedTuple):
    """The observation and its imperfections; n components, k control times."""

    columns: Kept
    """Place of each component in the readings, shape (n,)."""
    imperfections: Kept
    """Imperfections of each component, shape (n, 7); see tasks/observation/noise.py."""
    streams: Kept
    """Random stream of each component's noise, as a signed number, shape (n,)."""
    tremor: Cleared
    """Standard normal numbers for the tremor, one for each tick of the patient."""
    noise: Cleared
    """Standard normal numbers for each component, shape (k, n)."""
    memory: Cleared
    """Past readings, newest first, shape (depth, n)."""
    observation: Cleared
    """The observation, in the scales of the channels, shape (n,)."""


class EstimatorTables(NamedTuple):
    """The filter of the device, where an agent is shown what it estimates; see estimation/reduced_filter.py."""

    sensors: ObserverTables
    """What the device measures: channels with the noise of the group `device`, whether or not an agent sees them."""
    numbers: Kept
    """Numbers of the filter, at the places of NUMBERS."""
    curves: Kept
    """Table over the angle with the columns of CURVES."""
    disturbance: Kept
    """Covariance that a unit of net's power adds in a period, shape (3, 3)."""
    target: Kept
    """Place in the readings, and among the estimates, of each reading that is one, shape (k, 2)."""
    sensed: Cleared
    """Present measurements in their units, at the places of SENSED."""
    mean: Cleared
    """What is believed, at the places of BELIEF."""
    fast: Cleared
    slow: Cleared
    """Covariances, shapes (4, 4) and (2, 2)."""
    learnt: Cleared
    """What is learnt on the way, at the places of LEARNT."""
    estimates: Cleared
    """Estimates and their standard deviations, at the places of ESTIMATE."""


class DrawTables(NamedTuple):
    """The draw of the episode that a reset begins."""

    key: Filled
    """Key of the random streams (streams.py), as a signed number, shape (1,)."""
    patient: Filled
    """Row of the patient."""
    movement: Filled
    """Numbers of the movement."""
    task: Filled
    """Numbers that the task draws, in the order of `Task.draws`."""
    given: Filled
    """Load, angle and phase of the start, at the places of GIVEN."""


class ScalingTables(NamedTuple):
    """Numbers of the world that follow from a patient's sizes; see scaling.py."""

    coefficients: Kept
    """C for men, then for women, as far as anybody was one, shape (2 n, monomials); shared by worlds."""
    constants: Kept
    """Time constants of activation and deactivation of a muscle [s], shape (2,)."""
    numbers: Filled
    """C phi: the numbers of the model, then those that follow, which are views of it, shape (n,)."""
    targets: Kept
    """Where the model's numbers lie: a table as of arena.py, shape (k, 3)."""
    start: Filled
    """Coordinates at the start; true only for what does not move, shape (n_q,)."""
    muscles: Filled
    points: Filled
    elbow: Filled
    """Muscles, points of their paths, and centre of the elbow, as in an ArmTable."""
    forearm: Filled
    """Inertia about the elbow, mass, centre of mass and grip, as in a LoadTable, shape (8,)."""


class SubjectTables(NamedTuple):
    """Numbers of arm and load that are the same for all patients; the others are in ScalingTables."""

    sign: Kept
    first: Kept
    moving: Kept
    axis: Kept
    """Muscles and their paths, as in an ArmTable."""
    gravity: Kept
    """Gravity in ground axes [m/s^2], shape (3,)."""
    handle: Kept
    """Mass [kg], length [m], and distance of the centre of mass from the grip [m]."""
    low_pulley: Kept
    high_pulley: Kept
    """Pulleys of the gym machine in ground axes [m], each of shape (3,)."""
    weight_height: Kept
    """Height of the weight at the start [m], shape (1,)."""
    link: Kept
    """Mass and centre of mass of the lower link, shape (4,)."""
    rope: Kept
    """Ends of the rope that lifts, on upper and lower link [m], shape (2, 3)."""
    times: Kept
    """Times at which the command is planned [s]."""


class RestTables(NamedTuple):
    """Numbers of the world at rest; see rest_pose.py."""

    orientation: Kept
    """Euler parameters of both links where the hinge is at 0, shape (4,)."""
    misaligned: Kept
    """1 where the hinge axis is not that of the elbow, or 0, shape (1,)."""
    shift: Kept
    """Vector from the elbow centre to the hinge, in ground axes [m], shape (3,)."""
    guided: Kept
    """Point that the guide leads, in the forearm's frame [m]."""
    link_centre: Kept
    """Centre of mass of the lower link in its frame [m], shape (3,)."""
    places: Kept
    """First coordinate of what moves, in the order of BODIES of rest_pose.py."""
    fibres: Kept
    """Coordinate of each muscle's fibre length, its activation behind it, shape (m,)."""
    offset: Kept
    """Coordinate that the controller adds to psi, shape (1,), or (0,) where it adds none."""
    zeros: Kept
    """Coordinate of the zero of each spring that follows the hinge's angle (impedance controllers)."""
    rope: Kept
    """Place of the gym rope's length among the numbers of constraints, shape (1,)."""
    v: Filled
    """Rates at the start, 0 but for the controller's."""


class WorldTables(NamedTuple):
    """One world with all that acts in a control period and in a reset."""

    dynamics: DynamicsTables
    drive: DriveTables
    patient: PatientTables
    plan: PlanTables
    task: TaskTables
    observer: ObserverTables
    estimator: EstimatorTables
    draw: DrawTables
    scaling: ScalingTables
    subject: SubjectTables
    rest: RestTables
    period: Kept
    """Control period [s], shape (1,)."""
    cleared: Kept
    """Address and number of 8-byte words of every array that a reset sets to zero, shape (n, 2)."""
    status: Cleared
    """Progress of the episode, at the places of STATUS."""
    outcome: Cleared
    """Results of the last reset, at the places of OUTCOME."""


DYNAMICS, DRIVE, PATIENT_TABLES, PLAN, TASK, OBSERVER, ESTIMATOR, DRAW, SCALING, SUBJECT, REST, WORLD, EFFORT = map(
    fields,
    (
        DynamicsTables, DriveTables, PatientTables, PlanTables, TaskTables, ObserverTables, EstimatorTables, DrawTables,
        ScalingTables, SubjectTables, RestTables, WorldTables, EffortState,
    ),
)  # fmt: skip

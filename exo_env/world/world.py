"""The world of one environment: device, gym machine and drive, in which one patient after another takes place.

An episode differs from the one before in numbers only. All arrays of the world and of what acts on it are made once,
and filled anew for each patient (reset.py).
"""

from __future__ import annotations

import math

import numpy as np

from dms_core import Model, SolverOptions, World
from dms_core.errors import InputError, SimulationError
from dms_core.kernels import TABLE_CALL, Packed, address, compile_beside_models
from dms_core.model import ImpedanceController, MinimumJerk, Pid, RopeActuator
from dms_core.results import Result
from exo_env.clearing import cleared_areas
from exo_env.drives.checked import check_motors
from exo_env.drives.drive import Drive
from exo_env.ecosystem.arm import excitation_name
from exo_env.ecosystem.ecosystem import REFERENCE, Ecosystem
from exo_env.ecosystem.gym_machine import HANDLE, ROPE, WEIGHT, reach_error
from exo_env.ecosystem.person import SEXES
from exo_env.ecosystem.worn_exoskeleton import HINGE, LOWER, PID
from exo_env.patient.ability import Need
from exo_env.patient.excitation.effort import TICK, new_effort
from exo_env.patient.excitation.motor_command import arm_table, load_table, unsettled
from exo_env.patient.patient import FIELDS, PATIENT
from exo_env.streams import stream
from exo_env.tables import (
    FELT,
    GIVEN,
    OUTCOME,
    STATUS,
    DrawTables,
    DriveTables,
    DynamicsTables,
    EstimatorTables,
    ObserverTables,
    PatientTables,
    PlanTables,
    RestTables,
    ScalingTables,
    SubjectTables,
    TaskTables,
    WorldTables,
)
from exo_env.tasks.checked import check_movement, check_sensors
from exo_env.tasks.movements.movement import Movement
from exo_env.tasks.observation.channels import first_places
from exo_env.tasks.observation.observer import Observer
from exo_env.tasks.task import Task
from exo_env.world.draw import Draw
from exo_env.world.estimator import estimator_tables
from exo_env.world.kernels.episode_code import EPISODE_CODE
from exo_env.world.kernels.reset import BEGUN, GAPING, NO_RATES, PULLEY_IN_REACH, UNSETTLED, begin_episode, settle
from exo_env.world.kernels.scaling import TEMPLATE_ANGLE, declared, scaling_of

compile_beside_models(EPISODE_CODE)

PLANNING = 0.05
"""Interval of the motor command's table [s]; a tenth of it would change an activation by 0.002."""
NAMES_AT_REST = ("forearm", LOWER, HANDLE, WEIGHT, PID)
"""Elements whose first coordinates `RestTables.places` holds, in the order of rest_pose.MOVING."""


class PatientWorld:
    """The world of one environment.

    Args:
        ecosystem: anatomy, device and machine; its person and its weight do not matter.
        drive: makes commands of actions.
        task: says what is read, rewarded and ended.
        movement: says what patients intend.
        observer: says what is observed, and how well.
        period: control period [s].
        duration: length of an episode [s].
        steps: number of control periods in an episode.
        options: options of the solver.

    Raises:
        InputError: the ecosystem has no gym machine, the device does not fit the drive, or drive, movement or task
            declare what cannot be (drives/checked.py, tasks/checked.py).
    """

    def __init__(
        self,
        ecosystem: Ecosystem,
        drive: Drive,
        task: Task,
        movement: Movement,
        observer: Observer,
        *,
        period: float,
        duration: float,
        steps: int,
        options: SolverOptions,
    ) -> None:
        if ecosystem.machine is None:
            raise InputError("an environment needs a gym machine; this ecosystem has machine = None.")
        check_movement(movement)
        self.ecosystem, self.machine, self.drive, self.task = ecosystem, ecosystem.machine, drive, task
        self.movement, self.observer, self.options = movement, observer, options
        self.period, self.duration = period, duration
        self.times = np.arange(steps + 1) * period
        """Control times [s], shape (k,)."""
        # The patient's last tick may be the end's, and it looks a tick ahead.
        self._ticks = math.ceil(steps * period / TICK) + 2
        self._arm, self._worn = ecosystem.arm(), ecosystem.worn()
        self._scaling = scaling_of(ecosystem, drive)
        held = drive.start(ecosystem.device, 0.0)
        system = declared(
            ecosystem, drive, TEMPLATE_ANGLE, held, reference=_pieces(movement.pieces),
            activations=np.full(len(self._arm.muscles), 0.1),
        )  # fmt: skip
        self.model = Model(system, like=self._scaling.template)
        self.names = {name: k for k, (name, _) in enumerate(self.model.layout.outputs)}
        """Place of each sensor's component among the model's sensors."""
        check_sensors(type(task).__name__, task.readings, self.names)
        motors = [f.name for f in system.forces if isinstance(f, RopeActuator)]
        check_motors(drive, ecosystem.device, motors, self.model.layout.offset)
        self._build()

    def _build(self) -> None:
        """World and tables; those of a world whose rows were ordered anew are not used again."""
        self.dynamics = World(self.model, self.options)
        values = WorldTables(
            dynamics=self._dynamics(), drive=self._drive(), patient=self._patient(), plan=self._plan(),
            task=self._task(), observer=self._observer(), estimator=self._estimator(), draw=self._draw(),
            scaling=self._scaled(),
            subject=self._subject(), rest=self._rest(), period=np.array([self.period]),
            cleared=np.zeros((0, 2), np.int64), status=np.zeros(len(STATUS), np.int64), outcome=np.zeros(len(OUTCOME)),
        )  # fmt: skip
        self.tables = values._replace(cleared=cleared_areas(values))
        self.packed = Packed(self.tables)

    def follow_dynamics(self) -> None:
        """Take over the tables and arrays of equations that were ordered anew."""
        dynamics = self.tables.dynamics._replace(model=self.dynamics.tables, state=self.dynamics.packed)
        self.tables = self.tables._replace(dynamics=dynamics)
        self.packed = Packed(self.tables)

    def _row(self, name: str) -> int:
        """Row of a constant input in the signals of the world."""
        return int(self.dynamics.state.signals.ptr[self.model.input_index(name)])

    def _dynamics(self) -> DynamicsTables:
        options = np.array(self.options.numbers(), float)
        world = self.dynamics
        return DynamicsTables(world.tables, world.packed, self.model.sensing, options, np.zeros(len(self.names)))

    def _drive(self) -> DriveTables:
        device, at = self.ecosystem.device, self.model.layout.offset
        commands, actions = self.drive.commands(device), self.drive.actions(device)
        motors = [(at[c.motor], i) for i, c in enumerate(commands) if c.motor is not None]
        n = len(commands)
        return DriveTables(
            kernel=_address(self.drive.kernel), numbers=np.ascontiguousarray(self.drive.numbers(device), float),
            steps=np.array([c.rate for c in commands]) * self.period, start=self.drive.start_table(device),
            motors=np.array(motors, np.int64).reshape(-1, 2),
            rows=np.array([self._row(c.name) for c in commands], np.int64),
            hinge=np.array([self.names["exo_angle.angle"]], np.int64),
            axes=np.ascontiguousarray(self._worn.frame), action=np.zeros(len(actions)), before=np.zeros(len(actions)),
            wanted=np.zeros(n), commands=np.zeros(n),
        )  # fmt: skip

    def _patient(self) -> PatientTables:
        muscles = self._arm.muscles
        senses = [self.names[f"elbow_angle.{name}"] for name in FELT._fields]
        return PatientTables(
            traits=np.zeros(len(FIELDS)), effort=new_effort(self._arm.signs), ticks=np.zeros(1, np.int64),
            wanted=np.zeros((self._ticks, len(muscles))), course=np.zeros((self._ticks, 3)),
            excitations=np.zeros(len(muscles)),
            felt=np.zeros(len(FELT)), senses=np.array(senses, np.int64),
            rows=np.array([self._row(excitation_name(m)) for m in muscles], np.int64),
        )  # fmt: skip

    def _plan(self) -> PlanTables:
        signals, k, n = self.dynamics.state.signals, self.model.input_index(REFERENCE), len(self.times)
        first, end = int(signals.ptr[k]), int(signals.ptr[k + 1])
        return PlanTables(
            kernel=_address(self.movement.kernel), movement=np.zeros(self.movement.size(self.duration)),
            starts=signals.t[first:end], coefficients=signals.c[first:end], course=np.zeros((n, 3)),
            horizons=np.array(self.task.preview, float), preview=np.zeros((n, len(self.task.preview))),
            loads=np.zeros(n), needed=np.zeros(n), able=np.zeros(n), lacking=np.zeros(n), scale=np.zeros(1),
        )  # fmt: skip

    def _task(self) -> TaskTables:
        task = self.task
        first = first_places(task.readings)
        copied = [(self.names[s], first[i] + j) for i, r in enumerate(task.readings) for j, s in enumerate(r.sensors)]
        shown = [(first[i], FIELDS.index(r.trait)) for i, r in enumerate(task.readings) if r.trait is not None]
        source, target = np.array(copied, np.int64).reshape(-1, 2).T
        return TaskTables(
            read=_address(task.read), judge=_address(task.judge), first=first, source=source.copy(),
            target=target.copy(), shown=np.array(shown, np.int64).reshape(-1, 2),
            numbers=np.ascontiguousarray(task.numbers(), float),
            weights=task.weight_numbers(), readings=np.zeros(int(first[-1])), terms=np.zeros(len(task.terms)),
            reward=np.zeros(1),
        )  # fmt: skip

    def _observer(self) -> ObserverTables:
        return self._seen_by(self.observer, self._ticks)

    def _seen_by(self, o: Observer, ticks: int) -> ObserverTables:
        """Tables of an observer, with a number of the tremor for each tick."""
        return ObserverTables(
            columns=o.columns, imperfections=o.imperfections,
            streams=np.array([stream("tremor"), *o.streams]).view(np.int64), tremor=np.zeros(ticks),
            noise=np.zeros((len(self.times), o.size)), memory=o.memory(), observation=np.zeros(o.size),
        )  # fmt: skip

    def _estimator(self) -> EstimatorTables:
        return estimator_tables(
            self.observer, self.task, self.ecosystem, self.period, lambda device: self._seen_by(device, 0)
        )

    def _draw(self) -> DrawTables:
        movement, task = np.zeros(self.movement.size(self.duration)), np.zeros(len(self.task.draws()))
        return DrawTables(np.zeros(1, np.int64), np.zeros(len(FIELDS)), movement, task, np.zeros(len(GIVEN)))

    def _scaled(self) -> ScalingTables:
        numbers, defaults = np.zeros(len(self._scaling.coefficients(SEXES[0]))), self._arm.facts["muscle_defaults"]
        parts = self._scaling.split(numbers)
        constants = [defaults[f"{way}_time_constant"] for way in ("activation", "deactivation")]
        targets = np.array([(x.ctypes.data, x.size, 1) for x in self.model.numbers], np.int64)
        return ScalingTables(
            self._scaling.both, np.array(constants), numbers, targets, parts.start, parts.muscles, parts.points,
            parts.elbow, parts.forearm,
        )  # fmt: skip

    def _subject(self) -> SubjectTables:
        arm, machine, device = arm_table(self._arm), self.machine, self.ecosystem.device
        gravity, rope = load_table(self._arm, machine, 1.0).gravity, device.ropes[device.lifting_rope]
        handle, duration = machine.handle, self.duration
        return SubjectTables(
            sign=arm.sign, first=arm.first, moving=arm.moving, axis=arm.axis, gravity=gravity,
            handle=np.array([handle.mass, handle.length, handle.centre_of_mass]),
            low_pulley=np.array(machine.low_pulley), high_pulley=np.array(machine.high_pulley),
            weight_height=np.array([machine.weight_start]), link=device.lower_link.numbers(),
            rope=np.array([rope.upper, rope.lower]),
            times=np.linspace(0.0, duration, math.ceil(duration / PLANNING) + 1),
        )  # fmt: skip

    def _rest(self) -> RestTables:
        at, calls = self.model.layout.offset, self.model.tables.values.constraints
        joints = [c.element.name for c in self.model.layout.constraints]
        added = [f.offset for f in self.model.system.forces if isinstance(f, Pid) and f.name == PID and f.offset]
        springs = [f for f in self.model.system.forces if isinstance(f, ImpedanceController) and f.joint == HINGE]
        return RestTables(
            orientation=self._worn.orientation, misaligned=np.array([int(not self._worn.aligned)]),
            shift=np.ascontiguousarray(self._worn.shift), guided=np.ascontiguousarray(self._worn.guided_point),
            link_centre=np.array(self.ecosystem.device.lower_link.centre_of_mass),
            places=np.array([at[name] for name in NAMES_AT_REST]), fibres=np.array([at[m] for m in self._arm.muscles]),
            offset=np.array([self.model.layout.index[name] for name in added], np.int64),
            zeros=np.array([self.model.layout.index[f"{f.name}.zero"] for f in springs], np.int64),
            rope=calls.par_ptr[[joints.index(ROPE)]], v=np.zeros(self.model.n_q),
        )  # fmt: skip

    def prepare(self, draw: Draw) -> None:
        """Put the draw of the next episode where `begin_episode` reads it."""
        if self.dynamics.tables is not self.model.tables:
            self._build()
        into = self.tables.draw
        self._scaling.coefficients(SEXES[int(draw.patient[PATIENT.sex])])
        into.key[:] = np.uint64(draw.key).view(np.int64)
        into.patient[:], into.movement[:], into.task[:] = draw.patient, draw.movement, draw.task
        into.given[:] = draw.load, draw.start, draw.phase

    def begin(self) -> int:
        """Compiled part of an episode's begin; gives one of the codes of reset.py."""
        return begin_episode(self.packed.table)

    def begun(self, code: int) -> tuple[Draw, Need]:
        """What was drawn for the episode that has begun, and what its patient lacks.

        Args:
            code: what the compiled part gave.

        Raises:
            InputError: the arm could bring the rope's end to a pulley.
            SimulationError: there is no consistent start, or the motor command does not settle.
        """
        outcome = self.tables.outcome
        if code == NO_RATES and self.dynamics.reorder():
            # The orders of elimination were chosen elsewhere; a straight elbow needs others.
            self.follow_dynamics()
            code = settle(self.packed.table)
        if code == PULLEY_IN_REACH:
            raise reach_error(self.machine, self.tables.scaling.elbow, self.tables.scaling.forearm[5:])
        if code == UNSETTLED:
            raise unsettled(float(outcome[OUTCOME.left]), float(self.times[-1]))
        if code == NO_RATES:
            raise SimulationError(f"{Result.RATES_FAILED.value} (at the start of an episode)")
        if code == GAPING:
            raise SimulationError(
                f"the joints stay open by {outcome[OUTCOME.gap]:.3g} (m or -) at the start of an episode."
            )
        assert code == BEGUN
        self.dynamics.result = Result.SUCCESS
        plan, draw = self.tables.plan, self.tables.draw
        need = Need(float(outcome[OUTCOME.ability]), plan.lacking.copy(), float(plan.scale[0]))
        load, start, phase = draw.given.tolist()
        key, numbers = int(draw.key.view(np.uint64)[0]), (draw.movement.copy(), draw.task.copy())
        return Draw(key, draw.patient.copy(), load, *numbers, start, phase), need


def _address(kernel: object) -> np.ndarray:
    """Address of a compiled function of one packed table, shape (1,)."""
    return np.array([address(kernel, TABLE_CALL)], np.int64)


def _pieces(count: int) -> MinimumJerk:
    """A signal of that many pieces, at least FEWEST_PIECES; a movement's kernel fills them."""
    return MinimumJerk(times=tuple(map(float, range(count - 1))), values=(TEMPLATE_ANGLE,) * (count - 1))

"""Device, gym machine and motors in which one patient after another takes place.

An episode differs from the one before in numbers only. All arrays of the world and of what acts on it are made once,
and filled anew for each patient: sizes (fitting.py), start (start_kernel.py), course, command and need.
"""

from __future__ import annotations

import math

import numpy as np

from dms_core import Model, SolverOptions
from dms_core.assembly.arena import Packed
from dms_core.errors import SimulationError
from dms_core.model.signals import Pieces
from dms_core.results import Result
from dms_core.simulation.dynamics import World
from dms_core.simulation.newton import largest_errors
from dms_core.simulation.parts import CONSTRAINTS, run_part
from exo_env.actions import COMMANDS, Drive
from exo_env.command_kernel import ArmTable, LoadTable, drawn
from exo_env.control_period import Plant, begin
from exo_env.ecosystem import REFERENCE, Ecosystem
from exo_env.effort import reset_effort, samples_in, start_excitations
from exo_env.episode import Episode
from exo_env.events import Limits
from exo_env.exoskeleton import AGONIST, ANTAGONIST, LOWER, PID, WornExoskeleton
from exo_env.fitting import TEMPLATE_ANGLE, Numbers, declared, fitting, template
from exo_env.gym_machine import HANDLE, ROPE, WEIGHT, check_reach
from exo_env.human import MUSCLES, Arm, excitation_name
from exo_env.motor_command import InternalModel, plan_course
from exo_env.need import Need
from exo_env.observations import OF_PATIENT, PREVIEW, TRUTH, Observer
from exo_env.patient import Patient
from exo_env.plant import clear, plant_of
from exo_env.repetition import Repetition, course_of
from exo_env.rewards import Weights
from exo_env.start_kernel import Hardware, Places, put_start

PLANNING = 0.05
"""Interval of the motor command's table [s]; a tenth of it would change an activation by 0.002."""
STILL, BESIDE = 1e-9, 2
"""Rate of the reference below which it rests [rad/s]; samples planned on either side of a movement."""
FIRST_STEP = 0.5
"""First step tried in an episode, over the control period: inputs leave rest along straight lines of that length."""
CLOSED = 1e-10
"""Largest |phi| of a start [m or -], as in dms_core's assembly."""


class Rig:
    """The world of one environment.

    Args:
        ecosystem: device and machine.
        mode: action mode.
        drive: of this mode.
        period: control period [s].
        duration: of an episode [s].
        repetitions: of the movement in an episode.
        observer: what is observed, and how well.
        weights: of the reward.
        limits: that end an episode.
        options: of the solver.
    """

    def __init__(
        self,
        ecosystem: Ecosystem,
        mode: str,
        drive: Drive,
        *,
        period: float,
        duration: float,
        repetitions: int,
        observer: Observer,
        weights: Weights,
        limits: Limits,
        options: SolverOptions,
    ) -> None:
        assert ecosystem.machine is not None
        self.ecosystem, self.machine, self.drive = ecosystem, ecosystem.machine, drive
        self.period, self.options, self.observer = period, options, observer
        self.weights, self.limits = weights, limits
        self.times = np.arange(round(duration / period) + 1) * period
        self._planning = np.linspace(0.0, duration, math.ceil(duration / PLANNING) + 1)
        self._fitting = fitting(ecosystem, mode, drive)
        reference = Repetition(count=repetitions, every=duration / repetitions, rest=0.1).signal
        held = drive.start(0.0)
        system = declared(ecosystem, drive, TEMPLATE_ANGLE, held, reference=reference, activations=np.full(6, 0.1))
        self.model = Model(system, like=template(mode))
        self.names = {name: k for k, (name, _) in enumerate(self.model.layout.outputs)}
        self._internal = InternalModel.of(Arm(), self.machine, 1.0)
        worn = WornExoskeleton(ecosystem.device, Arm(), ecosystem.misalignment, ecosystem.guide)
        self._axes = np.ascontiguousarray(worn.axes)
        self._places, self._hardware, self._rope = self._find_places(), self._measured(worn), self._find_rope()
        self._build()

    def _build(self) -> None:
        """World and plant; those of a world whose rows were ordered anew are not used again."""
        self.world = World(self.model, self.options)
        inputs = [*self.drive.inputs, *(excitation_name(m) for m in MUSCLES)]
        rows = [self.world.state.signals.ptr[self.model.input_index(name)] for name in inputs]
        self.packed = plant_of(
            self.world, self.names, np.array(rows, np.int64), period=self.period, times=self.times,
            drive=self.drive.table(self.period), axes=self._axes, observer=self.observer, weights=self.weights,
            limits=self.limits,
        )  # fmt: skip
        self.plant: Plant = self.packed.values

    def follow_world(self) -> None:
        """Take over the tables and arrays of a world that has ordered its equations anew."""
        self.plant = self.plant._replace(model=self.world.tables, world=self.world.packed)
        self.packed = Packed(self.plant)

    def _find_places(self) -> Places:
        """Coordinates that a start fills."""
        at = self.model.layout.offset
        fibres = np.array([at[m] for m in MUSCLES])
        return Places(at["forearm"], at[LOWER], at[HANDLE], at[WEIGHT], at[PID], fibres)

    def _find_rope(self) -> int:
        """Place of the gym rope's length in the numbers of constraints."""
        calls = [c.element.name for c in self.model.layout.constraints]
        return int(self.model.tables.values.constraints.par_ptr[calls.index(ROPE)])

    def _measured(self, worn: WornExoskeleton) -> Hardware:
        """What is the same for all patients."""
        m, handle = self.machine, self.machine.handle
        return Hardware(
            worn.orientation, np.array(worn.device.lower_link.centre_of_mass),
            np.array([handle.mass, handle.length, handle.centre_of_mass]), np.array(m.low_pulley),
            np.array(m.high_pulley), m.weight_start,
        )  # fmt: skip

    def begin(
        self, patient: Patient, load: float, repetition: Repetition, start: float, generator: np.random.Generator
    ) -> Episode:
        """The patient at rest at the start of a movement.

        Args:
            patient: who.
            load: weight on the machine [kg].
            repetition: the movement.
            start: elbow angle [rad].
            generator: of the environment; tremor and noise of the whole episode are drawn here.

        Raises:
            InputError: the arm could bring the rope's end to a pulley.
            SimulationError: no consistent start was found.
        """
        if self.world.tables is not self.model.tables:
            self._build()
        numbers, pieces = self._fitting.numbers(patient, load), repetition.signal.pieces()
        known = self._fit(numbers, load)
        self._set_course(pieces)
        wanted = self._plan(known.expecting(patient.expected_load * load), pieces)
        need = Need.of(patient, known, self.ecosystem.device, self.plant.course)
        activations = self._rest(patient, wanted, need, generator)
        held = self.drive.start(self._holding_tension(known, start, activations))
        self._put_inputs(held, activations)
        self._start(known, start, activations, held, numbers.start)
        self._tell(patient, load)
        begin(self.packed.table)
        return Episode(self, patient, load, repetition, need)

    def _fit(self, numbers: Numbers, load: float) -> InternalModel:
        """Numbers of a person and a weight into the world; what a person knows who knows the weight."""
        check_reach(self.machine, numbers.elbow, numbers.forearm[5:])
        for mine, given in zip(self.model.numbers, numbers.model, strict=True):
            mine[...] = given
        forearm, known = numbers.forearm, self._internal
        arm: ArmTable = known.arm._replace(muscles=numbers.muscles, points=numbers.points, elbow=numbers.elbow)
        carried: LoadTable = known.load._replace(
            inertia=forearm[0], mass=forearm[1], centre_of_mass=forearm[2:5], grip=forearm[5:], weight=load
        )
        return InternalModel(arm, carried)

    def _set_course(self, pieces: Pieces) -> None:
        """The reference as input of the world and as table of the control period."""
        signals, plant = self.world.state.signals, self.plant
        k = self.model.input_index(REFERENCE)
        first, end = signals.ptr[k], signals.ptr[k + 1]
        # A movement without rest between its repetitions has fewer pieces: the last one stands for them.
        each = np.minimum(np.arange(end - first), len(pieces.t) - 1)
        signals.t[first:end], signals.c[first:end] = pieces.t[each], pieces.c[each]
        last, ahead = self.times[-1], np.empty((len(self.times), 3))
        course_of(pieces.t, pieces.c, self.times, plant.course)
        for k, t in enumerate(PREVIEW):
            course_of(pieces.t, pieces.c, np.minimum(self.times + t, last), ahead)
            plant.preview[:, k] = ahead[:, 0]

    def _plan(self, known: InternalModel, pieces: Pieces) -> np.ndarray:
        """The patient's command at each control time, shape (n, 6); what rests for long is planned once."""
        times, course = self._planning, np.empty((len(self._planning), 3))
        course_of(pieces.t, pieces.c, times, course)
        moves = np.flatnonzero(np.abs(course[:, 1]) > STILL)
        kept = np.zeros(len(times), bool)
        for beside in range(-BESIDE, BESIDE + 1):
            kept[np.clip(moves + beside, 0, len(times) - 1)] = True
        kept[:BESIDE] |= not len(moves)
        planned = plan_course(known, times[: kept.sum()], course[kept])
        rows = np.maximum(np.cumsum(kept) - 1, 0)
        drawn(planned.activations, rows, times[1], self.period, self.plant.wanted)
        return self.plant.wanted

    def _tell(self, patient: Patient, load: float) -> None:
        """What a privileged observer is told of the patient."""
        truth = self.plant.truth
        truth[:] = 0.0
        for place, name in OF_PATIENT:
            truth[place] = getattr(patient, name)
        truth[TRUTH.load] = load

    def _rest(self, patient: Patient, wanted: np.ndarray, need: Need, generator: np.random.Generator) -> np.ndarray:
        """Patient, need and noise into the plant; gives the activations of one who has wanted the start for long."""
        plant = self.plant
        clear(plant)
        plant.patient[:], plant.lacking[:], plant.scale[0] = patient.numbers(), need.lacking, need.scale
        samples, phase = samples_in(self.period), generator.uniform(0.0, 2.0 * math.pi)
        reset_effort(plant.patient, plant.effort, samples, self.period, wanted[0], phase)
        generator.standard_normal(out=plant.noise)
        return start_excitations(plant.effort, samples)

    def _holding_tension(self, known: InternalModel, start: float, activations: np.ndarray) -> float:
        """Agonist tension with which the arm rests at the start [N]; below 0 where the patient needs no help."""
        device, g = self.ecosystem.device, float(np.linalg.norm(known.load.gravity))
        needed = known.resting_moment(start) + device.own_moment(start, g)
        return (needed - known.muscle_moment(start, activations)) / device.moment_arm(AGONIST, start)

    def _put_inputs(self, held: np.ndarray, activations: np.ndarray) -> None:
        """Inputs at rest until the first control period."""
        signals, plant = self.world.state.signals, self.plant
        signals.t[plant.inputs], signals.c[plant.inputs] = 0.0, 0.0
        signals.c[plant.inputs, 0] = (*held, *activations)
        plant.commands[:] = held

    def _start(
        self, known: InternalModel, start: float, activations: np.ndarray, held: np.ndarray, q: np.ndarray
    ) -> None:
        """The world at its start; q holds what does not move, and takes the rest."""
        v, layout = np.zeros(self.model.n_q), self.model.layout
        numbers = self.model.tables.values.constraints.par
        numbers[self._rope] = put_start(
            known.arm, known.load, self._hardware, self._places, start, float(self.plant.course[0, 0]), activations, q,
            v,
        )  # fmt: skip
        for name, side in zip(COMMANDS, (AGONIST, ANTAGONIST), strict=True):
            if name in self.drive.inputs:
                q[layout.offset[f"{side}_motor"]] = held[self.drive.inputs.index(name)]
        self.world.begin(q, v, FIRST_STEP * self.period)
        if self.world.settle() is not Result.SUCCESS:
            raise SimulationError(f"{self.world.result.value} (at the start of an episode)")
        run_part(self.model.tables.table, self.world.packed.table, CONSTRAINTS)
        gap = largest_errors(self.world.packed.table)[0]
        if not gap <= CLOSED:
            raise SimulationError(f"the joints stay open by {gap:.3g} (m or -) at the start of an episode.")

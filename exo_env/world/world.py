"""Device, gym machine and motors in which one patient after another takes place.

An episode differs from the one before in numbers only. All arrays of the world and of what acts on it are made once,
and filled anew for each patient (opening.py).
"""

from __future__ import annotations

import math

import numpy as np

from dms_core import Model, SolverOptions
from dms_core.compiled.arena import Packed
from dms_core.errors import SimulationError
from dms_core.kernels import compile_beside_models
from dms_core.results import Result
from dms_core.simulation.dynamics import World
from exo_env.drives.drive import COMMANDS, Drive
from exo_env.ecosystem.arm import MUSCLES, Arm, excitation_name
from exo_env.ecosystem.ecosystem import REFERENCE, Ecosystem
from exo_env.ecosystem.exoskeleton import AGONIST, ANTAGONIST, LOWER, PID, WornExoskeleton
from exo_env.ecosystem.gym_machine import HANDLE, ROPE, WEIGHT, reach_error
from exo_env.patient.ability import Need
from exo_env.patient.motor_command import arm_table, load_table, unsettled
from exo_env.patient.patient import FIELDS, SEXES
from exo_env.tasks.limits import Limits
from exo_env.tasks.movement import MOVEMENT, Repetition
from exo_env.tasks.observer import Observer
from exo_env.tasks.rewards import Weights
from exo_env.world.control_period import READING, Plant
from exo_env.world.episode import Episode
from exo_env.world.episode_code import EPISODE_CODE
from exo_env.world.reset import (
    FOUND,
    GAPING,
    GIVEN,
    NO_RATES,
    OPEN,
    PULLEY_IN_REACH,
    UNSETTLED,
    Setting,
    open_episode,
    settle,
)
from exo_env.world.scaling import TEMPLATE_ANGLE, declared, fitting, template
from exo_env.world.tables import plant_of

compile_beside_models(EPISODE_CODE)

PLANNING = 0.05
"""Interval of the motor command's table [s]; a tenth of it would change an activation by 0.002."""


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
        self._fitting = fitting(ecosystem, mode, drive)
        reference = Repetition(count=repetitions, every=duration / repetitions, rest=0.1).signal
        held = drive.start(0.0)
        system = declared(ecosystem, drive, TEMPLATE_ANGLE, held, reference=reference, activations=np.full(6, 0.1))
        self.model = Model(system, like=template(mode))
        self.names = {name: k for k, (name, _) in enumerate(self.model.layout.outputs)}
        worn = WornExoskeleton(ecosystem.device, Arm(), ecosystem.misalignment, ecosystem.guide)
        self._axes = np.ascontiguousarray(worn.axes)
        self._build()
        samples = math.ceil(duration / PLANNING) + 1
        self.setting = Packed(self._setting(worn, np.linspace(0.0, duration, samples)))
        movement = self.setting.values.movement
        movement[MOVEMENT.often], movement[MOVEMENT.every] = repetitions, duration / repetitions

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

    def _setting(self, worn: WornExoskeleton, times: np.ndarray) -> Setting:
        """What an opening reads, without a patient."""
        machine, layout, signals = self.machine, self.model.layout, self.world.state.signals
        at, k, device = layout.offset, self.model.input_index(REFERENCE), worn.device
        arm, load, n = arm_table(Arm()), load_table(Arm(), machine, 1.0), len(self._fitting.coefficients(SEXES[0]))
        numbers, defaults = np.zeros(n), Arm().facts["muscle_defaults"]
        parts = self._fitting.split(numbers)
        motors = {name: f"{side}_motor" for name, side in zip(COMMANDS, (AGONIST, ANTAGONIST), strict=True)}
        follow = [(at[motors[name]], i) for i, name in enumerate(self.drive.inputs) if name in motors]
        calls, ropes = self.model.tables.values.constraints, [c.element.name for c in layout.constraints]
        return Setting(
            patient=np.zeros(len(FIELDS)), movement=np.zeros(len(MOVEMENT)), given=np.zeros(len(GIVEN)),
            found=np.zeros(len(FOUND)), coefficients=self._fitting.both,
            constants=np.array([defaults[f"{way}_time_constant"] for way in ("activation", "deactivation")]),
            numbers=numbers, start=parts.start, muscles=parts.muscles, points=parts.points, elbow=parts.elbow,
            forearm=parts.forearm, targets=_table_of(self.model.numbers), rope=calls.par_ptr[[ropes.index(ROPE)]],
            first=arm.first, moving=arm.moving, axis=arm.axis, gravity=load.gravity, link=worn.orientation,
            link_centre=np.array(device.lower_link.centre_of_mass),
            handle=np.array([machine.handle.mass, machine.handle.length, machine.handle.centre_of_mass]),
            low_pulley=np.array(machine.low_pulley), high_pulley=np.array(machine.high_pulley),
            weight_height=np.array([machine.weight_start]), lower_link=device.lower_link.numbers(),
            agonist=np.array([device.agonist.upper, device.agonist.lower]), holding=self.drive.holding(),
            motors=np.array(follow, np.int64).reshape(-1, 2),
            places=np.array([at[name] for name in ("forearm", LOWER, HANDLE, WEIGHT, PID)]),
            fibres=np.array([at[m] for m in MUSCLES]), reference=signals.ptr[k : k + 2].astype(np.int64), times=times,
            v=np.zeros(self.model.n_q),
        )  # fmt: skip

    def prepare(
        self, patient: np.ndarray, load: float, movement: np.ndarray, start: float, generator: np.random.Generator
    ) -> None:
        """Say who comes next, for `open_episode` with `packed` and `setting`.

        Args:
            patient: row of numbers in the order of FIELDS.
            load: weight on the machine [kg].
            movement: the first five numbers of MOVEMENT.
            start: elbow angle [rad].
            generator: of the environment; tremor and noise of the whole episode are drawn here.
        """
        if self.world.tables is not self.model.tables:
            self._build()
        setting: Setting = self.setting.values
        self._fitting.coefficients(SEXES[int(patient[FIELDS.index("sex")])])
        setting.patient[:], setting.movement[: len(movement)] = patient, movement
        setting.given[GIVEN.weight], setting.given[GIVEN.angle] = load, start
        setting.given[GIVEN.phase] = generator.uniform(0.0, 2.0 * math.pi)
        generator.standard_normal(out=self.plant.noise)

    def open(self) -> int:
        """Compiled part of an episode's begin; gives what came of it."""
        return open_episode(self.packed.table, self.setting.table)

    def opened(self, code: int) -> Episode:
        """The patient at rest at the start of a movement, where an opening gave that code.

        Raises:
            InputError: the arm could bring the rope's end to a pulley.
            SimulationError: no consistent start was found.
        """
        setting: Setting = self.setting.values
        found = setting.found
        if code == NO_RATES and self.world.reorder():
            # The orders of elimination were chosen elsewhere; a straight elbow wants others.
            self.follow_world()
            code = settle(self.packed.table, self.setting.table)
        if code == PULLEY_IN_REACH:
            raise reach_error(self.machine, setting.elbow, setting.forearm[5:])
        if code == UNSETTLED:
            raise unsettled(float(found[FOUND.left]), float(self.times[-1]))
        if code == NO_RATES:
            raise SimulationError(f"{Result.RATES_FAILED.value} (at the start of an episode)")
        if code == GAPING:
            raise SimulationError(
                f"the joints stay open by {found[FOUND.gap]:.3g} (m or -) at the start of an episode."
            )
        assert code == OPEN
        self.world.result = Result.SUCCESS
        need = Need(float(found[FOUND.ability]), self.plant.lacking.copy(), float(self.plant.scale[0]))
        start = float(self.plant.reading[READING.angle])
        return Episode(
            self, setting.patient.copy(), float(setting.given[GIVEN.weight]), setting.movement.copy(), need, start
        )


def _table_of(arrays: tuple[np.ndarray, ...]) -> np.ndarray:
    """Where arrays of floats lie, as a table that arena.py reads."""
    return np.array([(x.ctypes.data, x.size, 1) for x in arrays], np.int64)

"""One episode's world: patient, load, repetition, motor command, and the compiled model they are simulated with.

All episodes of an action mode have one structure, so a model compiled once in a process lends its elimination orders to
all of them. It is made of fixed numbers, never of the first patient, so that a seed gives the same bits whatever was
simulated before.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache

import numpy as np

from dms_core import Model, SolverOptions
from dms_core.errors import SimulationError
from dms_core.model import Constant
from dms_core.results import Result
from dms_core.simulation.dynamics import World
from exo_env.actions import DRIVES, Drive, drive_inputs
from exo_env.ecosystem import Ecosystem
from exo_env.effort import Effort
from exo_env.exoskeleton import AGONIST, WornExoskeleton
from exo_env.human import MUSCLES, Arm
from exo_env.motor_command import InternalModel, MotorCommand, plan_course
from exo_env.need import Need
from exo_env.patient import Patient
from exo_env.repetition import Repetition

PLANNING = 0.05
"""Interval of the motor command's table [s]; a tenth of it would change an activation by 0.002."""
TEMPLATE_ANGLE = 1.0
"""Elbow angle at which the elimination orders are chosen [rad], amid the exercise."""


@lru_cache(maxsize=8)
def template(mode: str) -> Model:
    """The model whose elimination orders all episodes of an action mode take over."""
    used = DRIVES[mode]()
    start = used.start(0.0)
    return Model(
        Ecosystem().system(
            TEMPLATE_ANGLE,
            Constant(value=TEMPLATE_ANGLE),
            device_forces=lambda worn: used.forces(worn, start),
            device_inputs=drive_inputs(used, start),
        )
    )


class Episode:
    """A patient in the device, at the start of a repetition.

    Args:
        ecosystem: device and machine; the person and the weight are set here.
        mode: action mode.
        drive: of this mode.
        patient: who.
        repetition: the movement.
        start: elbow angle at the start [rad].
        period: control period [s].
        duration: of the episode [s].
        generator: of the environment; the patient draws from it.
        options: of the solver.
    """

    def __init__(
        self,
        *,
        ecosystem: Ecosystem,
        mode: str,
        drive: Drive,
        patient: Patient,
        repetition: Repetition,
        start: float,
        period: float,
        duration: float,
        generator: np.random.Generator,
        options: SolverOptions,
    ) -> None:
        self.patient, self.repetition, self.drive, self.period = patient, repetition, drive, period
        self.ecosystem = ecosystem.changed(person=patient.person)
        self.arm = Arm(patient.person)
        self.worn = WornExoskeleton(ecosystem.device, self.arm, ecosystem.misalignment, ecosystem.guide)
        self.times = np.arange(round(duration / period) + 1) * period
        self.course = repetition.course(self.times)
        self.wanted = self._wanted(duration)
        self.need = Need.of(patient, self._known(self.ecosystem.weight), ecosystem.device, self.course)
        self.effort = Effort(patient, period, generator)
        activations = self.effort.reset(self.wanted[0])
        # Commands at the start; later ones are in the Plant.
        self.held = drive.start(self._holding_tension(start, activations))
        system = self.ecosystem.system(
            start,
            repetition.signal,
            {m: Constant(value=float(a)) for m, a in zip(MUSCLES, activations, strict=True)},
            start_activation=dict(zip(MUSCLES, map(float, activations), strict=True)),
            muscle_times=patient.time_constants(self.arm),
            device_forces=lambda worn: drive.forces(worn, self.held),
            device_inputs=drive_inputs(drive, self.held),
        )
        self.model = Model(system, like=template(mode))
        self.world = World(self.model, options)
        # Accelerations and reactions of the start, for the first reading.
        if self.world.settle() is not Result.SUCCESS:
            raise SimulationError(f"{self.world.result.value} (at the start of an episode)")

    @cached_property
    def names(self) -> dict[str, int]:
        """Place of each sensor's component in a reading."""
        return {name: k for k, (name, _) in enumerate(self.model.layout.outputs)}

    def _wanted(self, duration: float) -> np.ndarray:
        """The patient's command at each control time, shape (n, 6)."""
        load = self.patient.expected_load * self.ecosystem.weight
        times = np.linspace(0.0, duration, math.ceil(duration / PLANNING) + 1)
        command: MotorCommand = plan_course(self._known(load), times, self.repetition.course(times))
        return np.stack([np.interp(self.times, times, column) for column in command.activations.T], axis=1)

    def _known(self, load: float) -> InternalModel:
        """What somebody knows who expects this weight [kg]."""
        assert self.ecosystem.machine is not None
        return InternalModel.of(self.arm, self.ecosystem.machine, load)

    def _holding_tension(self, start: float, activations: np.ndarray) -> float:
        """Agonist tension with which the arm rests at the start [N]; below 0 where the patient needs no help."""
        known, device = self._known(self.ecosystem.weight), self.ecosystem.device
        needed = known.resting_moment(start) + device.own_moment(start, float(np.linalg.norm(self.arm.gravity)))
        return (needed - known.muscle_moment(start, activations)) / device.moment_arm(AGONIST, start)

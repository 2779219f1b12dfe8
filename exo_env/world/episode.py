"""One episode: who is in the device, what is lifted along which movement, and the world that moves."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from dms_core import Model
from dms_core.simulation.dynamics import World
from exo_env.drives.drive import Drive
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.exoskeleton import WornExoskeleton
from exo_env.patient.ability import Need
from exo_env.patient.effort import STATE
from exo_env.patient.patient import Patient
from exo_env.tasks.movement import Repetition

if TYPE_CHECKING:
    from exo_env.world.world import Rig


class Episode:
    """A patient in the rig. World, model and effort are those of the present: another patient's after the next reset.

    Args:
        rig: device, machine and world.
        who: the patient as a row of numbers in the order of FIELDS.
        load: weight on the machine [kg].
        movement: the repetition as a row of numbers in the order of MOVEMENT.
        need: of the patient on this movement.
        start: elbow angle at its start [rad].
    """

    def __init__(self, rig: Rig, who: np.ndarray, load: float, movement: np.ndarray, need: Need, start: float) -> None:
        self.rig, self.who, self.load, self.movement, self.need, self.start = rig, who, load, movement, need, start
        self.course = rig.plant.course.copy()
        """psi [rad], its rate [rad/s] and its acceleration [rad/s^2] at the control times, shape (n, 3)."""

    @cached_property
    def patient(self) -> Patient:
        """Who."""
        return Patient.of_row(self.who)

    @cached_property
    def repetition(self) -> Repetition:
        """The movement, with how often it is done."""
        return Repetition.of_row(self.movement)

    @property
    def drive(self) -> Drive:
        """Of the action mode."""
        return self.rig.drive

    @property
    def times(self) -> np.ndarray:
        """Control times [s]."""
        return self.rig.times

    @property
    def world(self) -> World:
        """What moves."""
        return self.rig.world

    @property
    def model(self) -> Model:
        """The world's equations, with the numbers of this patient; its declarations and start are another's."""
        return self.rig.model

    @property
    def names(self) -> dict[str, int]:
        """Place of each sensor's component in a reading."""
        return self.rig.names

    @property
    def effort(self) -> float:
        """What the patient intends, as a multiple of what was planned: s [-]."""
        return float(self.rig.plant.effort[STATE.effort])

    @cached_property
    def ecosystem(self) -> Ecosystem:
        """Person, device, machine and weight."""
        return self.rig.ecosystem.changed(person=self.patient.person, weight=self.load)

    @cached_property
    def arm(self) -> Arm:
        """Of the patient."""
        return Arm(self.patient.person)

    @cached_property
    def worn(self) -> WornExoskeleton:
        """The device on this arm."""
        e = self.ecosystem
        return WornExoskeleton(e.device, self.arm, e.misalignment, e.guide)

"""One episode: who is in the device, what is lifted along which movement, and the world that moves."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from dms_core import Model, World
from exo_env.drives.drive import Drive
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.worn_exoskeleton import WornExoskeleton
from exo_env.patient.ability import Need
from exo_env.patient.excitation.effort import PRESENT
from exo_env.patient.patient import Patient
from exo_env.tables import WorldTables
from exo_env.world.draw import Draw
from exo_env.world.world import PatientWorld


class Episode:
    """A patient in the device. World, model and effort are those of the present: another's after the next reset.

    Args:
        world: world in which it takes place.
        draw: what is drawn for it.
        need: what the patient lacks on this movement.
    """

    def __init__(self, world: PatientWorld, draw: Draw, need: Need) -> None:
        self._world, self.draw, self.need = world, draw, need
        self.course = world.tables.plan.course.copy()
        """psi [rad], its rate [rad/s] and its acceleration [rad/s^2] at the control times, shape (n, 3)."""

    @cached_property
    def patient(self) -> Patient:
        """The patient in the device."""
        return Patient.of_row(self.draw.patient)

    @property
    def load(self) -> float:
        """Weight on the machine [kg]."""
        return self.draw.load

    @property
    def movement(self) -> np.ndarray:
        """Numbers of the movement."""
        return self.draw.movement

    @property
    def drive(self) -> Drive:
        """The drive, which makes commands of actions."""
        return self._world.drive

    @property
    def times(self) -> np.ndarray:
        """Control times [s]."""
        return self._world.times

    @property
    def world(self) -> World:
        """The simulation of dms_core that moves."""
        return self._world.dynamics

    @property
    def tables(self) -> WorldTables:
        """All arrays of the world, as they are now."""
        return self._world.tables

    @property
    def model(self) -> Model:
        """The world's equations, with the numbers of this patient; its declarations and start are another's."""
        return self._world.model

    @property
    def names(self) -> dict[str, int]:
        """Place of each sensor's component in a reading of the model."""
        return self._world.names

    @property
    def effort(self) -> float:
        """Effort s of the patient, as a multiple of the planned command [-]."""
        return float(self.tables.patient.effort.present[PRESENT.effort])

    @cached_property
    def ecosystem(self) -> Ecosystem:
        """Person, device, machine and weight."""
        return self._world.ecosystem.changed(person=self.patient.person, weight=self.load)

    @cached_property
    def arm(self) -> Arm:
        """The patient's arm."""
        return self.ecosystem.arm()

    @cached_property
    def worn(self) -> WornExoskeleton:
        """The device on this arm."""
        return self.ecosystem.worn()

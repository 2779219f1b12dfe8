"""What a maker knows of the worn device and of an average man's arm, as tables over the angle.

Of the patient who wears it nobody has told the device anything. The average man is the one of exo_env's `Person`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dms_core.model.muscles.activation import MINIMUM
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.ecosystem.person import Person
from exo_env.patient.excitation.motor_command import InternalModel
from exo_env.patient.excitation.static_optimisation import needed_moment
from exo_env.patient.patient import MIDDLE

ANGLES = np.radians(np.arange(0.0, 144.0, 2.0))
"""Angles of the tables [rad]; between them moments err by less than 0.01 Nm."""


@dataclass(frozen=True)
class Known:
    """Tables over the angle, and an inertia. All moments are about the elbow, positive where they flex [Nm]."""

    ecosystem: Ecosystem

    @cached_property
    def levers(self) -> np.ndarray:
        """Moment arm of each rope [m], shape (ropes, k)."""
        device = self.ecosystem.device
        return np.array([[device.moment_arm(rope, x) for x in ANGLES] for rope in device.ropes])

    @cached_property
    def own(self) -> np.ndarray:
        """Moment that holds forearm, hand, handle and lower link, shape (k,)."""
        return np.array([self._model(0.0).resting_moment(x) for x in ANGLES]) + self.link

    @cached_property
    def link(self) -> np.ndarray:
        """Moment that holds the device's lower link, shape (k,)."""
        gravity = float(np.linalg.norm(self._arm.gravity))
        return np.array([self.ecosystem.device.own_moment(x, gravity) for x in ANGLES])

    @cached_property
    def kilogram(self) -> np.ndarray:
        """Moment that holds each kilogram on the machine [Nm/kg], shape (k,)."""
        one, none = self._model(1.0), self._model(0.0)
        return np.array([one.resting_moment(x) - none.resting_moment(x) for x in ANGLES])

    @cached_property
    def inertia(self) -> float:
        """Of forearm, hand, handle and lower link about the elbow [kg m^2]: a rigid arm's, the same at all angles."""
        model = self._model(0.0)
        turned, still = (needed_moment(model.arm, model.load, MIDDLE, 0.0, x) for x in (1.0, 0.0))
        return float(turned - still + self.ecosystem.device.own_inertia())

    @cached_property
    def muscles(self) -> np.ndarray:
        """Moment of each muscle at full activation, at rest, above that at the least activation, shape (m, k)."""
        model, count = self._model(0.0), len(self._arm.muscles)
        least = np.full(count, MINIMUM)
        full = least + (1.0 - MINIMUM) * np.eye(count)
        rest = np.array([model.muscle_moment(x, least) for x in ANGLES])
        return np.array([[model.muscle_moment(x, one) for x in ANGLES] for one in full]) - rest

    @cached_property
    def _arm(self) -> Arm:
        return self.ecosystem.changed(person=Person()).arm()

    def _model(self, load: float) -> InternalModel:
        machine: GymMachine | None = self.ecosystem.machine
        assert machine is not None
        return InternalModel.of(self._arm, machine, load)


def at(table: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Rows of a table, or a single one, at angles of many worlds [rad].

    Args:
        table: over ANGLES, shape (k,) or (rows, k).
        angles: shape (n,); beyond the table its end is taken.

    Returns:
        Shape (n,) or (rows, n).
    """
    if table.ndim == 1:
        return np.interp(angles, ANGLES, table)
    return np.array([np.interp(angles, ANGLES, row) for row in table])

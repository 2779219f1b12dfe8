"""What the exercise needs, and what of it a patient cannot give: the measure of help that is needed.

    ability = M_voluntary / M_hold, from 0 to 1, both about the elbow at 60 deg, the middle of the exercise

M_hold holds arm and weight at rest. M_voluntary is what the muscles give at rest with all flexors driven as far as the
patient can: maximum activation, less what is fatigued at the start, and the extensors with the share that co-contracts.
A patient of ability 0.2 or more counts as one who can do something (assumed, and fixed before any policy was trained).

What is lacking along the reference, with the moment M_need of arm and weight (motor_command.py, with the real weight)
and the moment M_own that holds the lower link of the device, which is no help to carry:

    M_lack = (1 - ability) max(M_need, 0) + M_own
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dms_core.model.muscles.activation import MINIMUM
from exo_env.command_kernel import needed_moments
from exo_env.exoskeleton import Exoskeleton
from exo_env.human import FLEXORS, MUSCLES
from exo_env.motor_command import InternalModel
from exo_env.patient import Patient

MIDDLE = math.radians(60.0)
"""Angle of the ability [rad]."""
ABLE = 0.2
"""Ability from which a patient can do something [-]."""
SMALLEST_SCALE = 1.0
"""Of the need, where a movement hardly needs anything [Nm]."""


def voluntary_moment(patient: Patient, known: InternalModel, angle: float = MIDDLE) -> float:
    """Largest static elbow moment that the patient can want [Nm]."""
    rested = 1.0 - patient.fatigued_at_start
    flexors, extensors = patient.maximum_activation_flexors, patient.maximum_activation_extensors
    against = min(patient.co_contraction * flexors, extensors * rested)
    given = [flexors * rested if m in FLEXORS else against for m in MUSCLES]
    return known.muscle_moment(angle, np.maximum(given, MINIMUM))


def ability(patient: Patient, known: InternalModel) -> float:
    """What the patient can hold of arm and load, from 0 to 1 [-].

    Args:
        patient: who.
        known: arm, machine and real weight.
    """
    hold = known.resting_moment(MIDDLE)
    return min(max(voluntary_moment(patient, known) / hold, 0.0), 1.0) if hold > 0.0 else 1.0


@dataclass(frozen=True)
class Need:
    """Of one episode."""

    ability: float
    """Of the patient with this load [-]."""
    lacking: np.ndarray
    """M_lack at each control time [Nm], shape (n,)."""
    scale: float
    """Mean of M_need over the episode, at least 1 Nm [Nm]."""

    @classmethod
    def of(cls, patient: Patient, known: InternalModel, device: Exoskeleton, course: np.ndarray) -> Need:
        """What a movement needs.

        Args:
            patient: who.
            known: arm, machine and real weight.
            device: whose lower link is carried.
            course: psi [rad], its rate and its acceleration at the control times, shape (n, 3).
        """
        arm, load, able = known.arm, known.load, ability(patient, known)
        g = float(np.linalg.norm(load.gravity))
        needed = np.zeros(len(course))
        needed_moments(arm, load, course, needed)
        needed = np.maximum(needed, 0.0)
        return cls(
            able, (1.0 - able) * needed + device.own_moment(course[:, 0], g), max(float(needed.mean()), SMALLEST_SCALE)
        )

"""What the exercise needs, and what of it a patient cannot give: the measure of help that is needed.

    ability = M_voluntary / M_hold, from 0 to 1, both about the elbow at 60 deg, the middle of the exercise

M_hold holds arm and weight at rest. M_voluntary is what the muscles give at rest with all flexors driven as far as the
patient can: maximum activation, less what is fatigued at the start, and the extensors with the share that co-contracts.
A patient of ability 0.2 or more counts as one who can do something (assumed, and fixed before any policy was trained).

What is lacking along the reference, with the moment M_need of arm and weight (motor_command.py, with the real weight)
and the moment M_own that holds the lower link of the device, which is no help to carry:

    M_lack = (1 - ability) max(M_need, 0) + M_own

In the course of an episode the patient tires: ability then is that of a moment M_voluntary that has fallen, or risen,
as the rested share of the flexors has since the start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import dot, vec
from dms_core.model.muscles.activation import MINIMUM
from exo_env.ecosystem.exoskeleton import link_moment
from exo_env.patient.excitation.motor_command import InternalModel
from exo_env.patient.excitation.static_optimisation import muscle_moment, needed_moment, needed_moments, with_weight
from exo_env.patient.patient import MIDDLE, PATIENT, Patient

ABLE = 0.2
"""Ability from which a patient can do something [-]."""
SMALLEST_SCALE = 1.0
"""Least scale of the need, for a movement that hardly needs anything [Nm]."""


@compiled
def voluntary(patient, arm, angle):
    """Largest static elbow moment [Nm] that a patient, a row of numbers, can want at an angle [rad]."""
    rested = 1.0 - patient[PATIENT.fatigued_at_start]
    flexors, extensors = patient[PATIENT.maximum_activation_flexors], patient[PATIENT.maximum_activation_extensors]
    against, given = min(patient[PATIENT.co_contraction] * flexors, extensors * rested), np.empty(arm.sign.shape[0])
    for i in range(given.shape[0]):
        given[i] = max(flexors * rested if arm.sign[i] > 0.0 else against, MINIMUM)
    return muscle_moment(arm, angle, given)


@compiled
def able(patient, arm, load):
    """M_voluntary / M_hold, which may be above 1 [-]; tables as in static_optimisation.py."""
    hold = needed_moment(arm, load, MIDDLE, 0.0, 0.0)
    return max(voluntary(patient, arm, MIDDLE) / hold, 0.0) if hold > 0.0 else math.inf


@compiled
def lacking_when(lacking, needed, ratio, rested):
    """M_lack [Nm] of a patient who has tired.

    Args:
        lacking: M_lack as fatigued as at the start [Nm].
        needed: M_need [Nm].
        ratio: M_voluntary / M_hold as fatigued as at the start [-].
        rested: rested share of the flexors over that at the start [-].
    """
    return lacking + (min(ratio, 1.0) - min(ratio * rested, 1.0)) * max(needed, 0.0)


@compiled
def put_lacking(patient, arm, load, weights, link, course, needed, ratio, lacking):
    """Fill M_need [Nm], M_voluntary / M_hold [-] and M_lack [Nm] along a course with a weight at each time.

    Gives ability and scale as in `Need`.

    The ability is that with the weight of `load`; who carries more for a while lacks more.
    """
    share, total, gravity = able(patient, arm, load), 0.0, vec(load.gravity, 0)
    g, ability, weight = math.sqrt(dot(gravity, gravity)), min(share, 1.0), load.weight
    needed_moments(arm, load, weights, course, needed)
    for k in range(course.shape[0]):
        if weights[k] != weight:
            weight = weights[k]
            share = able(patient, arm, with_weight(load, weight))
        most = max(needed[k], 0.0)
        total += most
        ratio[k] = share
        lacking[k] = (1.0 - min(share, 1.0)) * most + link_moment(link, course[k, 0], g)
    return ability, max(total / course.shape[0], SMALLEST_SCALE)


def ability(patient: Patient, known: InternalModel) -> float:
    """Share of arm and load that the patient can hold, from 0 to 1 [-].

    Args:
        patient: the patient.
        known: internal model with the patient's arm, the machine and the real weight.
    """
    return min(able(patient.row(), known.arm, known.load), 1.0)


@dataclass(frozen=True)
class Need:
    """What the movement of an episode needs, and what the patient lacks of it."""

    ability: float
    """Ability of the patient with this load [-]."""
    lacking: np.ndarray
    """M_lack at each control time [Nm], shape (n,)."""
    scale: float
    """Mean of M_need over the episode, at least 1 Nm [Nm]."""

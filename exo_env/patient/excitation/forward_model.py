"""Prediction through the delay: what a patient's own corrections have done that is not felt yet (Smith predictor).

What is felt of the error is late by the feedback delay d. Who corrects by it at a higher gain corrects the same error
twice and swings. The cerebellum is thought to hold a model of the limb that runs ahead on a copy of the command (Miall,
Weir, Wolpert and Stein 1993): of what is felt, it takes what the model says of then, and adds what it says of now,

    y^(t) = y(t - d) - prediction (z(t) - z(t - d)),    y = e + T e',   z = x + T x'

with the error e = psi - theta, the lead T (feedback_lead), and the angle x by which the limb would have moved for the
feedback alone:

    lag m' = u - m,    inertia x'' + damping (x' + x / forgetting) = m

u is the copy of the feedback: of each muscle, the voluntary drive with it less that without, times the muscle's moment
at full activation, as late as the electromechanical delay. Inertia is that of arm and expected load; moments and
damping are those of the patient's own muscles in the middle of the exercise, damping by the slope of force over fibre
velocity at the mean of the command; the lag is the mean of the muscles' time constants, as slow as this patient's. That
patients know their limb so well is assumed; `prediction` says which share of it they use. The model forgets, so that a
steady push that nobody predicted leaves z(t) = z(t - d) and no bias after a while: what the arm does in the long run is
felt anyway.
"""

from __future__ import annotations

import math

from dms_core.compiled.jit import compiled
from dms_core.model.muscles.activation import MINIMUM
from dms_core.model.muscles.fibre import fibre_at_rest, fibre_state, pennation_cosine, tendon_state
from exo_env.patient.excitation.static_optimisation import needed_moment, path_geometry
from exo_env.patient.patient import MIDDLE, PATIENT
from exo_env.places import places

LIMB = places(("inertia", "damping", "lag", "moment", "angle", "rate"))
"""Places in `EffortState.limb`: inertia about the elbow [kg m^2], damping [Nm s/rad] and lag of the muscles [s], then
the model's present moment [Nm], angle [rad] and rate [rad/s]."""
FORGETTING = 0.3
"""Time in which the model forgets where it has gone [s]: a steady moment leaves z(t) - z(t - d) after that; assumed,
several times the delay."""


@compiled
def put_limb(par, arm, load, constants, held, limb, levers):
    """Fill what a patient knows of its limb.

    Args:
        par: numbers of the patient, at the places of PATIENT.
        arm: its ArmTable.
        load: LoadTable of the load that it expects.
        constants: time constants of activation and deactivation of a healthy muscle [s], shape (2,).
        held: mean activation of each muscle in the movement [-], shape (m,).
        limb: numbers at the places of LIMB, at rest.
        levers: moment of each muscle at full activation [Nm], extensors negative, shape (m,).
    """
    limb[:] = 0.0
    limb[LIMB.inertia] = needed_moment(arm, load, MIDDLE, 0.0, 1.0) - needed_moment(arm, load, MIDDLE, 0.0, 0.0)
    rise, fall = par[PATIENT.activation_time_scale] * constants[0], par[PATIENT.deactivation_time_scale] * constants[1]
    limb[LIMB.lag] = 0.5 * (rise + fall)
    for i in range(levers.shape[0]):
        numbers, activation = arm.muscles[i], max(held[i], MINIMUM)
        length, lever = path_geometry(arm, i, MIDDLE)
        full = tendon_state(numbers, length, fibre_at_rest(numbers, length, 1.0))[0]
        least = tendon_state(numbers, length, fibre_at_rest(numbers, length, MINIMUM))[0]
        levers[i] = lever * (full - least)
        fibre = fibre_at_rest(numbers, length, activation)
        cosine = pennation_cosine(numbers, fibre)[0]
        limb[LIMB.damping] += (lever * cosine) ** 2 * fibre_state(numbers, fibre, 0.0, activation)[3]


@compiled
def advance_limb(limb, command, duration):
    """Advance the model by a time [s] under a commanded moment [Nm], by an implicit step, which is always stable."""
    moment = command + (limb[LIMB.moment] - command) * math.exp(-duration / limb[LIMB.lag])
    inertia, damping, angle, h = limb[LIMB.inertia], limb[LIMB.damping], limb[LIMB.angle], duration
    stiffness = damping / FORGETTING
    rate = (inertia * limb[LIMB.rate] + h * (moment - stiffness * angle)) / (inertia + h * damping + h * h * stiffness)
    limb[LIMB.moment], limb[LIMB.rate], limb[LIMB.angle] = moment, rate, angle + h * rate

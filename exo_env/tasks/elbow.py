"""Readings that every task of the assisted elbow may use, and the kernel that fills them.

A task of its own begins its list with `elbow_readings`, puts further ones behind, and calls `read_elbow` in its `read`;
ELBOW then holds the places of the first ones.
"""

from __future__ import annotations

import math

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner, matrix
from exo_env.ecosystem.sensors import muscle_sensor, tension_sensor
from exo_env.patient.ability import lacking_when
from exo_env.patient.excitation.effort import PRESENT
from exo_env.patient.excitation.slacking import MOST_EFFORT
from exo_env.patient.patient import PATIENT
from exo_env.places import places
from exo_env.tables import DRIVE, EFFORT, PATIENT_TABLES, PLAN, WORLD
from exo_env.tasks.checked import begins
from exo_env.tasks.observation.channels import Channel, Imperfection, Parts, Reading, trait_channels, trait_readings
from exo_env.tasks.task import first_of, readings, step_of


def elbow_readings(parts: Parts) -> list[Reading]:
    """Angles, tensions, moments and forces; what was planned; the patient's effort, load and traits."""
    ropes, muscles, xyz = parts.ropes, parts.muscles, ("x", "y", "z")
    return [
        Reading("angle", "rad", sensors=("elbow_angle.angle",)),
        Reading("rate", "rad/s", sensors=("elbow_angle.rate",)),
        Reading("hinge", "rad", sensors=("exo_angle.angle",)),
        Reading("hinge_rate", "rad/s", sensors=("exo_angle.rate",)),
        Reading("tension", "N", ropes, sensors=tuple(map(tension_sensor, ropes))),
        Reading("muscle_moment", "Nm", sensors=("muscle_moment",)),
        Reading("exo_moment", "Nm", sensors=("exo_moment",)),
        Reading("elbow_force", "N", xyz, sensors=tuple(f"elbow_reaction.F{x}" for x in xyz)),
        Reading("guide", "N", xyz, sensors=tuple(f"guide_force.F{x}" for x in xyz)),
        Reading("muscle_force", "N", muscles, sensors=tuple(muscle_sensor(m, "tendon_force") for m in muscles)),
        Reading("activation", "-", muscles, sensors=tuple(muscle_sensor(m, "activation") for m in muscles)),
        Reading("reaction", "N"),
        Reading("guide_force", "N"),
        Reading("device_share", "-"),
        Reading("error", "rad"),
        Reading("reference", "rad"),
        Reading("reference_rate", "rad/s"),
        Reading("last_action", "-", parts.action_labels),
        Reading("fatigued", "-", muscles),
        Reading("effort", "-"),
        Reading("load", "kg"),
        *trait_readings(),
    ]


_NAMES = [reading.name for reading in elbow_readings(Parts((), (), ()))]
ELBOW = places(_NAMES)
"""Place of each reading in the list of `elbow_readings`."""
begins(ELBOW, elbow_readings)


def device_channels() -> list[Channel]:
    """Channels of what a worn device measures of itself.

    Noise, assumed: an encoder of 12 bits, its filtered difference, rope and guide force sensors of half a per cent.
    """
    return [
        Channel("angle", 1.0, -0.5, 3.0, Imperfection(quantum=0.0015), "hinge"),
        Channel("rate", 1.0, -20.0, 20.0, Imperfection(deviation=0.02), "hinge_rate"),
        Channel("tension", 100.0, 0.0, 1600.0, Imperfection(deviation=1.0)),
        Channel("guide_force", 10.0, -500.0, 500.0, Imperfection(deviation=0.5)),
    ]


def action_channel() -> Channel:
    """Channel of the last action."""
    return Channel("last_action", 1.0, -1.0, 1.0)


def emg_channels() -> list[Channel]:
    """Activations as an envelope of surface electromyography, whose noise is 3 % of the maximum: assumed."""
    return [Channel("emg", 1.0, 0.0, 1.0, Imperfection(deviation=0.03), "activation")]


def privileged_channels() -> list[Channel]:
    """Channels of what only a simulation knows of the patient."""
    return [
        *trait_channels(),
        Channel("load", 1.0, 0.0, 50.0),
        Channel("muscle_force", 500.0, 0.0, 10000.0),
        Channel("fatigued", 1.0, 0.0, 1.0),
        Channel("effort", 1.0, 0.0, MOST_EFFORT),
        Channel("device_share", 1.0, 0.0, 1.0),
    ]


@compiled
def device_share(muscles, device):
    """Share of the device in the moment of muscles and device, from 0 to 1 [-]; both are given in Nm."""
    both = muscles + device
    if both == 0.0:
        return 0.0
    way = math.copysign(1.0, both)
    carried, own = max(way * device, 0.0), max(way * muscles, 0.0)
    return carried / (carried + own)


@compiled
def lacking_of(w):
    """What the patient, as tired as now, lacks of the moment that the plan needs now, with that of the device [Nm]."""
    plan, patient, k = inner(w, WORLD.plan), inner(w, WORLD.patient), step_of(w)
    state, fresh = inner(patient, PATIENT_TABLES.effort), 0.0
    sign, fatigued, rested = floats(state, EFFORT.sign), floats(state, EFFORT.fatigued), 0.0
    for i in range(sign.shape[0]):
        if sign[i] > 0.0:
            fresh += 1.0 - floats(patient, PATIENT_TABLES.traits)[PATIENT.fatigued_at_start]
            rested += 1.0 - fatigued[i]
    return lacking_when(
        floats(plan, PLAN.lacking)[k], floats(plan, PLAN.needed)[k], floats(plan, PLAN.able)[k], rested / fresh
    )


@compiled
def read_elbow(w):
    """Fill the readings of `elbow_readings` that no sensor gives."""
    r, at, drive = readings(w), first_of(w), inner(w, WORLD.drive)
    first = at[ELBOW.tension]
    for i in range(at[ELBOW.muscle_moment] - first):
        r[first + i] = max(r[first + i], 0.0)
    f = at[ELBOW.elbow_force]
    r[at[ELBOW.reaction]] = math.sqrt(r[f] ** 2 + r[f + 1] ** 2 + r[f + 2] ** 2)
    # The x axis of the lower link.
    axes, hinge, guide = matrix(drive, DRIVE.axes), r[at[ELBOW.hinge]], 0.0
    c, s = math.cos(hinge), math.sin(hinge)
    for i in range(3):
        guide += r[at[ELBOW.guide] + i] * (axes[i, 0] * c + axes[i, 1] * s)
    r[at[ELBOW.guide_force]] = guide
    r[at[ELBOW.device_share]] = device_share(r[at[ELBOW.muscle_moment]], r[at[ELBOW.exo_moment]])
    course, k = matrix(inner(w, WORLD.plan), PLAN.course), step_of(w)
    r[at[ELBOW.error]] = r[at[ELBOW.angle]] - course[k, 0]
    r[at[ELBOW.reference]], r[at[ELBOW.reference_rate]] = course[k, 0], course[k, 1]
    action = floats(drive, DRIVE.action)
    for i in range(action.shape[0]):
        r[at[ELBOW.last_action] + i] = action[i]
    state = inner(inner(w, WORLD.patient), PATIENT_TABLES.effort)
    fatigued = floats(state, EFFORT.fatigued)
    for i in range(fatigued.shape[0]):
        r[at[ELBOW.fatigued] + i] = fatigued[i]
    r[at[ELBOW.effort]] = floats(state, EFFORT.present)[PRESENT.effort]
    r[at[ELBOW.load]] = floats(inner(w, WORLD.plan), PLAN.loads)[k]

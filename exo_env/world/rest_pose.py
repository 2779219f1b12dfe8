"""Compiled start of an episode: where bodies, handle, fibres and controller are with the elbow at rest at an angle.

The device is aligned with the elbow, so that its hinge has the elbow's angle and every joint is closed by formula.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.bracket import narrowed, trial
from dms_core.model.geometry.rotations import add, cross, dot, rotated, scale, sub, vec
from dms_core.model.muscles.muscle import fibre_at_rest
from exo_env.jit import compiled
from exo_env.patient.static_optimisation import path_geometry, turned

MOST_TRIALS = 200
"""Of the handle's angle; its bracket is empty long before."""


class Places(NamedTuple):
    """Where the coordinates of the start are in q."""

    forearm: int
    lower: int
    handle: int
    weight: int
    """First coordinate of each body that moves."""
    pid: int
    """Of the controller."""
    muscles: np.ndarray
    """Fibre length of each muscle, its activation behind it, shape (6,)."""


class Hardware(NamedTuple):
    """What is the same for all patients."""

    link: np.ndarray
    """Euler parameters of an aligned link where the elbow is straight, shape (4,)."""
    link_centre: np.ndarray
    """Centre of mass of the lower link in its frame [m], shape (3,)."""
    handle: np.ndarray
    """Mass [kg], length [m], and distance of its centre of mass from the grip [m]."""
    low_pulley: np.ndarray
    high_pulley: np.ndarray
    weight_height: float
    """Of the weight at the start [m]."""


@compiled
def quaternion_of(axis, angle):
    """Euler parameters of a turn about a unit triple."""
    s = math.sin(0.5 * angle)
    return math.cos(0.5 * angle), s * axis[0], s * axis[1], s * axis[2]


@compiled
def product(p, r):
    """Euler parameters of r, then p."""
    return (
        p[0] * r[0] - p[1] * r[1] - p[2] * r[2] - p[3] * r[3],
        p[0] * r[1] + p[1] * r[0] + p[2] * r[3] - p[3] * r[2],
        p[0] * r[2] - p[1] * r[3] + p[2] * r[0] + p[3] * r[1],
        p[0] * r[3] + p[1] * r[2] - p[2] * r[1] + p[3] * r[0],
    )


@compiled
def _handle_moment(axis, gravity, to_pulley, handle, weight, angle):
    """Moment about the grip that turns the handle back [Nm]: of the rope and of its own weight."""
    down = turned(axis, math.cos(angle), math.sin(angle), (0.0, -1.0, 0.0))
    length = handle[1]
    pull = sub(to_pulley, scale(length, down))
    tension = weight * math.sqrt(dot(gravity, gravity)) / math.sqrt(dot(pull, pull))
    return -(length * tension * dot(axis, cross(down, pull)) + handle[0] * handle[2] * dot(axis, cross(down, gravity)))


@compiled
def handle_angle(axis, gravity, to_pulley, handle, weight):
    """Angle about the elbow axis, from hanging straight down, at which the handle rests [rad].

    The rope pulls with the weight's force, the handle has its own, and the grip turns freely.

    Args:
        axis: of the elbow, a triple.
        gravity: a triple [m/s^2].
        to_pulley: from the grip to the low pulley, a triple [m].
        handle: mass [kg], length [m], distance of the centre of mass from the grip [m].
        weight: mass on the rope [kg].
    """
    about = math.atan2(to_pulley[0], -to_pulley[1])
    low, high, moved = about - 1.5, about + 1.5, 0.0
    f_low = _handle_moment(axis, gravity, to_pulley, handle, weight, low)
    f_high = _handle_moment(axis, gravity, to_pulley, handle, weight, high)
    for _ in range(MOST_TRIALS):
        x = trial(low, f_low, high, f_high)
        if not low < x < high:
            break
        f = _handle_moment(axis, gravity, to_pulley, handle, weight, x)
        low, f_low, high, f_high, moved = narrowed(low, f_low, high, f_high, moved, x, f)
    return 0.5 * (low + high)


@compiled
def _put_body(q, at, origin, p, centre):
    """A body whose frame is at `origin` with Euler parameters p; its coordinates are those of its centre of mass."""
    for i in range(4):
        q[at + 3 + i] = p[i]
    c = rotated(q, at, centre)
    for i in range(3):
        q[at + i] = origin[i] + c[i]


@compiled
def _distance(a, b):
    d = sub(b, a)
    return math.sqrt(dot(d, d))


@compiled
def put_start(arm, load, hardware, places, angle, reference, activations, q, v):
    """Fill q and v of what moves; gives the length of the gym rope [m].

    Args:
        arm: an ArmTable.
        load: a LoadTable with the real weight.
        hardware: a Hardware.
        places: a Places.
        angle: of the elbow [rad].
        reference: psi at the start [rad].
        activations: of the muscles, shape (6,).
        q: coordinates, of which the constant ones stay.
        v: their rates, 0 but for the controller's.
    """
    n, elbow, gravity = vec(arm.axis, 0), vec(arm.elbow, 0), vec(load.gravity, 0)
    c, s = math.cos(angle), math.sin(angle)
    r = turned(n, c, s, vec(load.grip, 0))
    grip = add(elbow, r)
    _put_body(q, places.forearm, elbow, quaternion_of(n, angle), vec(load.centre_of_mass, 0))
    p = hardware.link
    about_hinge = quaternion_of((0.0, 0.0, 1.0), angle)
    _put_body(q, places.lower, elbow, product((p[0], p[1], p[2], p[3]), about_hinge), vec(hardware.link_centre, 0))
    low, high = vec(hardware.low_pulley, 0), vec(hardware.high_pulley, 0)
    to_pulley = sub(low, grip)
    hangs = quaternion_of(n, handle_angle(n, gravity, to_pulley, hardware.handle, load.weight))
    _put_body(q, places.handle, grip, hangs, (0.0, -hardware.handle[2], 0.0))
    end = add(grip, rotated(q, places.handle, (0.0, -hardware.handle[1], 0.0)))
    weight = (high[0], hardware.weight_height, high[2])
    _put_body(q, places.weight, weight, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    v[places.pid] = reference - angle
    for i in range(activations.shape[0]):
        fibre = fibre_at_rest(arm.muscles[i], path_geometry(arm, i, angle)[0], activations[i])
        q[places.muscles[i]], q[places.muscles[i] + 1] = fibre, activations[i]
    return _distance(end, low) + _distance(low, high) + _distance(high, weight)

"""Compiled start of an episode: where bodies, handle, fibres and controller are with the elbow at rest at an angle.

Every joint is closed by formula. Where the device is aligned with the elbow, its hinge has the elbow's angle; where it
is not, the guide says which: it leads a point of the forearm in the plane of the lower link that holds the hinge axis.
"""

from __future__ import annotations

import math

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner, ints, matrix
from dms_core.model.geometry.rotations import add, cross, dot, rotated, sub, turned, vec
from dms_core.model.muscles.fibre import fibre_at_rest
from exo_env.ecosystem.gym_machine import handle_angle
from exo_env.patient.excitation.static_optimisation import path_geometry
from exo_env.places import places
from exo_env.tables import DRIVE, REST, SUBJECT, WORLD

MOVING = places(("forearm", "lower_link", "handle", "weight", "pid"))
"""What moves, in the order of `RestTables.places`: four bodies, by their first coordinate, and the controller."""


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
def _put_body(q, at, origin, p, centre):
    """Put a body with its frame at `origin` and Euler parameters p; its coordinates are those of its centre of mass."""
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
def hinge_angle(w, arm, angle):
    """Angle of the hinge where the elbow is at an angle [rad]."""
    if ints(inner(w, WORLD.rest), REST.misaligned)[0] == 0:
        return angle
    x, y = _in_hinge_axes(w, sub(_guided(w, arm, angle), vec(floats(inner(w, WORLD.rest), REST.shift), 0)))
    return math.atan2(x, -y)


@compiled
def hinge_transmission(w, arm, angle):
    """Rate of the hinge over that of the elbow, at an angle of the elbow [rad] [-]."""
    if ints(inner(w, WORLD.rest), REST.misaligned)[0] == 0:
        return 1.0
    r = _guided(w, arm, angle)
    x, y = _in_hinge_axes(w, sub(r, vec(floats(inner(w, WORLD.rest), REST.shift), 0)))
    dx, dy = _in_hinge_axes(w, cross(vec(arm.axis, 0), r))
    return (x * dy - y * dx) / (x * x + y * y)


@compiled
def _guided(w, arm, angle):
    """Vector from the elbow to the guided point of the forearm, in ground axes [m]."""
    point = vec(floats(inner(w, WORLD.rest), REST.guided), 0)
    return turned(vec(arm.axis, 0), math.cos(angle), math.sin(angle), point)


@compiled
def _in_hinge_axes(w, r):
    """Components of a vector along the x and y axes of the upper link."""
    axes, x, y = matrix(inner(w, WORLD.drive), DRIVE.axes), 0.0, 0.0
    for i in range(3):
        x += axes[i, 0] * r[i]
        y += axes[i, 1] * r[i]
    return x, y


@compiled
def put_rest(w, arm, load, angle, reference, activations, q, v):
    """Fill q and v of what moves; gives the length of the gym rope [m].

    Args:
        w: the world.
        arm: an ArmTable.
        load: a LoadTable with the real weight.
        angle: angle of the elbow [rad].
        reference: psi at the start [rad].
        activations: activations of the muscles [-], shape (m,).
        q: coordinates, filled, of which the constant ones stay.
        v: their rates, which are 0 but for the controller's.
    """
    subject, rest = inner(w, WORLD.subject), inner(w, WORLD.rest)
    at, fibres = ints(rest, REST.places), ints(rest, REST.fibres)
    n, elbow, gravity = vec(arm.axis, 0), vec(arm.elbow, 0), vec(load.gravity, 0)
    r = turned(n, math.cos(angle), math.sin(angle), vec(load.grip, 0))
    grip = add(elbow, r)
    _put_body(q, at[MOVING.forearm], elbow, quaternion_of(n, angle), vec(load.centre_of_mass, 0))
    hinge, p = hinge_angle(w, arm, angle), floats(rest, REST.orientation)
    link = product((p[0], p[1], p[2], p[3]), quaternion_of((0.0, 0.0, 1.0), hinge))
    at_hinge = add(elbow, vec(floats(rest, REST.shift), 0)) if ints(rest, REST.misaligned)[0] == 1 else elbow
    _put_body(q, at[MOVING.lower_link], at_hinge, link, vec(floats(rest, REST.link_centre), 0))
    low, high = vec(floats(subject, SUBJECT.low_pulley), 0), vec(floats(subject, SUBJECT.high_pulley), 0)
    handle = floats(subject, SUBJECT.handle)
    hangs = quaternion_of(n, handle_angle(n, gravity, sub(low, grip), handle, load.weight))
    _put_body(q, at[MOVING.handle], grip, hangs, (0.0, -handle[2], 0.0))
    end = add(grip, rotated(q, at[MOVING.handle], (0.0, -handle[1], 0.0)))
    weight = (high[0], floats(subject, SUBJECT.weight_height)[0], high[2])
    _put_body(q, at[MOVING.weight], weight, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    v[at[MOVING.pid]] = reference - hinge
    zeros = ints(rest, REST.zeros)
    for k in range(zeros.shape[0]):
        q[zeros[k]] = hinge
    for i in range(activations.shape[0]):
        fibre = fibre_at_rest(arm.muscles[i], path_geometry(arm, i, angle)[0], activations[i])
        q[fibres[i]], q[fibres[i] + 1] = fibre, activations[i]
    return _distance(end, low) + _distance(low, high) + _distance(high, weight)

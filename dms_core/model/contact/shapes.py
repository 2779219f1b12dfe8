"""Where two shapes touch: gap, normal and point of contact, and how they change with the coordinates.

The first body carries a half-space, a sphere or a solid cylinder, the second one a sphere, a disc (one end of a
cylinder) or the side of a cylinder:

    plane, sphere    n = A_i m,        g = n . (c - P) - R,     X = c - (n . (c - P)) n
    sphere, sphere   n = d / |d|,      g = |d| - R_i - R_j,     X = c_j - (R_j + g / 2) n,      d = c_j - c_i
    plane, disc      Y = c - R t / sqrt(|t|^2 + e^2),   t = n - (n . f) f,   g = n . (Y - P),   X = Y - g n
    cylinder, sphere n = w_r t / |t| + w_a f,   g = D - R,   X = c - (R + g / 2) n,   d = c - P,   t = d - (d . f) f
    sides            as two spheres, about the nearest points of both axes (axis_pair.py)

with the centre c, the disc's axis f = A_j b and its deepest point Y. A disc that lies flat in the plane has no deepest
point: e = 1e-6 lets Y pass to its centre there. A point is a sphere without radius. Of a cylinder, P is the middle,
f = A_i b the axis, D the distance of c from its surface and (w_r, w_a) the slopes of D (solid_cylinder.py).

A change is a derivative by one local coordinate, with the others held.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from dms_core.compiled.jit import compiled
from dms_core.model.contact.axis_pair import nearest, nearest_change
from dms_core.model.contact.solid_cylinder import distance, distance_change
from dms_core.model.geometry.rotations import (
    across,
    across_change,
    add,
    bilinear,
    dot,
    euler_parameters,
    point,
    rotated,
    scale,
    sub,
    vec,
)

PLANE_SPHERE, SPHERES, PLANE_DISC, CYLINDER_SPHERE, CYLINDERS = 0, 1, 2, 3, 4
"""First integer of a contact's table."""
FLAT = 1e-6
"""Sine of the angle between a disc and the plane from which on its deepest point passes to its centre [-]."""
SHORTEST = 1e-9
"""Distance of two centres below which there is no normal [m]."""
BODY_I, BODY_J = 0, 7
"""Offsets of both bodies."""


class ContactNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point of the plane, or centre of the sphere or cylinder of body i, from its centre of mass [m]."""
    direction: int = 3
    """Normal of the plane, or axis of the cylinder, of body i."""
    radius_i: int = 6
    s_j: int = 7
    """Centre of the sphere or disc from the centre of mass of body j [m]."""
    axis: int = 10
    radius: int = 13
    stiffness: int = 14
    damping: int = 15
    """D [s/m]; with an impact speed from an input, d."""
    friction: int = 16
    slip_speed: int = 17
    half_length: int = 18
    """Of the cylinder of body i [m]."""
    half_length_j: int = 19
    """Of the cylinder of body j [m]."""


CONTACT = ContactNumbers()


@compiled
def touching(shape, par, q):
    """(g, n, X)."""
    s_i, c = vec(par, CONTACT.s_i), point(q, BODY_J, vec(par, CONTACT.s_j))
    P, R = point(q, BODY_I, s_i), par[CONTACT.radius]
    if shape == CYLINDERS:
        P, c = _nearest_points(par, q, P, c)
    if shape in (SPHERES, CYLINDERS):
        d = sub(c, P)
        length = max(math.sqrt(dot(d, d)), SHORTEST)
        n, g = scale(1.0 / length, d), length - par[CONTACT.radius_i] - R
        return g, n, sub(c, scale(R + 0.5 * g, n))
    n = rotated(q, BODY_I, vec(par, CONTACT.direction))
    if shape == CYLINDER_SPHERE:
        d = sub(c, P)
        along, t = dot(n, d), across(d, n)
        rho = max(math.sqrt(dot(t, t)), SHORTEST)
        D, w_r, w_a, _ = distance(par[CONTACT.radius_i], par[CONTACT.half_length], rho, along)
        n, g = add(scale(w_r / rho, t), scale(w_a, n)), D - R
        return g, n, sub(c, scale(R + 0.5 * g, n))
    if shape == PLANE_DISC:
        t = across(n, rotated(q, BODY_J, vec(par, CONTACT.axis)))
        Y = sub(c, scale(R / _size(t), t))
        g = dot(n, sub(Y, P))
        return g, n, sub(Y, scale(g, n))
    h = dot(n, sub(c, P))
    return h - R, n, sub(c, scale(h, n))


@compiled
def _size(t):
    """Regularised length of t."""
    return math.sqrt(dot(t, t) + FLAT * FLAT)


@compiled
def unit_change(k, o):
    """What coordinate k changes of the body at offset o by: (dr, dp), a triple and a 4-tuple."""
    i = k - o
    return (
        (1.0 * (i == 0), 1.0 * (i == 1), 1.0 * (i == 2)),
        (1.0 * (i == 3), 1.0 * (i == 4), 1.0 * (i == 5), 1.0 * (i == 6)),
    )


@compiled
def turned_by(q, o, dp, s):
    """The change of A(p) s of the body at offset o."""
    return scale(2.0, bilinear(euler_parameters(q, o), dp, s))


@compiled
def touch_change(shape, par, q, k):
    """(dg, dn, dX) along coordinate k."""
    dr_i, dp_i = unit_change(k, BODY_I)
    dr_j, dp_j = unit_change(k, BODY_J)
    s_i, s_j, R = vec(par, CONTACT.s_i), vec(par, CONTACT.s_j), par[CONTACT.radius]
    P, c = point(q, BODY_I, s_i), point(q, BODY_J, s_j)
    dP, dc = add(dr_i, turned_by(q, BODY_I, dp_i, s_i)), add(dr_j, turned_by(q, BODY_J, dp_j, s_j))
    if shape == CYLINDERS:
        P, c, dP, dc = _nearest_points_change(par, q, P, c, dP, dc, dp_i, dp_j)
    if shape in (SPHERES, CYLINDERS):
        d, dd = sub(c, P), sub(dc, dP)
        length = max(math.sqrt(dot(d, d)), SHORTEST)
        n = scale(1.0 / length, d)
        dg = dot(n, dd)
        dn = scale(1.0 / length, sub(dd, scale(dg, n)))
        reach = R + 0.5 * (length - par[CONTACT.radius_i] - R)
        return dg, dn, sub(dc, add(scale(0.5 * dg, n), scale(reach, dn)))
    m = vec(par, CONTACT.direction)
    n, dn = rotated(q, BODY_I, m), turned_by(q, BODY_I, dp_i, m)
    if shape == CYLINDER_SPHERE:
        return _cylinder_change(par, R, n, dn, sub(c, P), sub(dc, dP), dc)
    if shape == PLANE_DISC:
        b = vec(par, CONTACT.axis)
        f, df = rotated(q, BODY_J, b), turned_by(q, BODY_J, dp_j, b)
        t, dt = across(n, f), across_change(n, f, dn, df)
        size = _size(t)
        d_size = dot(t, dt) / size
        Y = sub(c, scale(R / size, t))
        dY = sub(dc, scale(R / size, sub(dt, scale(d_size / size, t))))
        g, dg = dot(n, sub(Y, P)), dot(dn, sub(Y, P)) + dot(n, sub(dY, dP))
        return dg, dn, sub(dY, add(scale(dg, n), scale(g, dn)))
    h, dh = dot(n, sub(c, P)), dot(dn, sub(c, P)) + dot(n, sub(dc, dP))
    return dh, dn, sub(dc, add(scale(dh, n), scale(h, dn)))


@compiled
def _nearest_points(par, q, P, c):
    """Points of the axes of two cylinders with the middles P and c."""
    f_i = rotated(q, BODY_I, vec(par, CONTACT.direction))
    f_j = rotated(q, BODY_J, vec(par, CONTACT.axis))
    s, t, _, _ = nearest(sub(c, P), f_i, f_j, par[CONTACT.half_length], par[CONTACT.half_length_j])
    return add(P, scale(s, f_i)), add(c, scale(t, f_j))


@compiled
def _nearest_points_change(par, q, P, c, dP, dc, dp_i, dp_j):
    """These points, and their changes for those of the middles and of both bodies' Euler parameters."""
    b_i, b_j = vec(par, CONTACT.direction), vec(par, CONTACT.axis)
    h_i, h_j = par[CONTACT.half_length], par[CONTACT.half_length_j]
    f_i, df_i = rotated(q, BODY_I, b_i), turned_by(q, BODY_I, dp_i, b_i)
    f_j, df_j = rotated(q, BODY_J, b_j), turned_by(q, BODY_J, dp_j, b_j)
    d, dd = sub(c, P), sub(dc, dP)
    s, t, s_is_free, t_is_free = nearest(d, f_i, f_j, h_i, h_j)
    ds, dt = nearest_change(
        s, t, s_is_free, t_is_free, h_i, h_j, dot(f_i, f_j), dot(df_i, d) + dot(f_i, dd), dot(df_j, d) + dot(f_j, dd),
        dot(df_i, f_j) + dot(f_i, df_j),
    )  # fmt: skip
    return (
        add(P, scale(s, f_i)),
        add(c, scale(t, f_j)),
        add(dP, add(scale(ds, f_i), scale(s, df_i))),
        add(dc, add(scale(dt, f_j), scale(t, df_j))),
    )


@compiled
def _cylinder_change(par, R, f, df, d, dd, dc):
    """(dg, dn, dX) of a sphere at d from the middle of a cylinder with the axis f, for changes of f, d and c."""
    along, t = dot(f, d), across(d, f)
    rho = max(math.sqrt(dot(t, t)), SHORTEST)
    e, dt = scale(1.0 / rho, t), across_change(d, f, dd, df)
    d_along, d_rho = dot(df, d) + dot(f, dd), dot(e, dt)
    D, w_r, w_a, bend = distance(par[CONTACT.radius_i], par[CONTACT.half_length], rho, along)
    dg, dw_r, dw_a = distance_change(w_r, w_a, bend, d_rho, d_along)
    n = add(scale(w_r, e), scale(w_a, f))
    dn = add(add(scale(dw_r, e), scale(w_r / rho, sub(dt, scale(d_rho, e)))), add(scale(dw_a, f), scale(w_a, df)))
    return dg, dn, sub(dc, add(scale(0.5 * dg, n), scale(R + 0.5 * (D - R), dn)))

"""The kernel of every contact: a force F on body j and -F on body i at the point of contact X.

With lever rho = X - r and omega = 2 E(p) pdot of each body, E(p) = [-e, p0 I + skew(e)], its rows are

    r_r = -F,   r_p = -2 E^T (rho x F)            for body j; the opposite for body i

and F follows from gap and velocity at X (law.py, shapes.py). Derivatives are taken coordinate by coordinate: 14 by q,
14 by v, only while the bodies touch.
"""

from __future__ import annotations

from dms_core.compiled.jit import compiled
from dms_core.model.contact.law import contact_force, contact_force_change, normal_force
from dms_core.model.contact.shapes import BODY_I, BODY_J, CONTACT, touch_change, touching, unit_change
from dms_core.model.geometry.rotations import add, cross, dot, euler_parameters, scale, sub, vec

SLOWEST_IMPACT = 1e-3
"""Smallest speed of an impact that an input is taken to mean [m/s]."""


@compiled
def spin(p, x):
    """2 E(p) x: the angular velocity for x = pdot, linear in both."""
    e, y = (p[1], p[2], p[3]), (x[1], x[2], x[3])
    return scale(2.0, add(add(scale(-x[0], e), scale(p[0], y)), cross(e, y)))


@compiled
def spin_load(p, M):
    """2 E(p)^T M: the generalised load on the Euler parameters of a moment M in ground axes."""
    e = (p[1], p[2], p[3])
    y = sub(scale(p[0], M), cross(e, M))
    return (-2.0 * dot(e, M), 2.0 * y[0], 2.0 * y[1], 2.0 * y[2])


@compiled
def _velocity(q, v, o, X):
    """Velocity at X of the body at offset o."""
    omega = spin(euler_parameters(q, o), euler_parameters(v, o))
    return add(vec(v, o), cross(omega, sub(X, vec(q, o))))


@compiled
def relative_velocity(q, v, X):
    """Velocity at X of body j against body i."""
    return sub(_velocity(q, v, BODY_J, X), _velocity(q, v, BODY_I, X))


@compiled
def _velocity_change(q, v, o, X, dX, dr, dp):
    """Its change with the coordinates of the body at offset o, and with X."""
    p, pd = euler_parameters(q, o), euler_parameters(v, o)
    turn = cross(spin(dp, pd), sub(X, vec(q, o)))
    return add(turn, cross(spin(p, pd), sub(dX, dr)))


@compiled
def _velocity_change_by_rates(q, o, X, dv, dpd):
    """Its change with the rates of the body at offset o."""
    return add(dv, cross(spin(euler_parameters(q, o), dpd), sub(X, vec(q, o))))


@compiled
def _put_column(J_out, q, o, sign, X, F, dX, dF, dr, dp, k):
    """Column k of the rows of the body at offset o; sign is 1 for body j."""
    p, lever = euler_parameters(q, o), sub(X, vec(q, o))
    M, dM = cross(lever, F), add(cross(sub(dX, dr), F), cross(lever, dF))
    one, two = spin_load(dp, M), spin_load(p, dM)
    for m in range(3):
        J_out[o + m, k] -= sign * dF[m]
    for m in range(4):
        J_out[o + 3 + m, k] -= sign * (one[m] + two[m])


@compiled
def velocity_changes(q, v, X, dX, k):
    """What coordinate k, with which X moves by dX, changes the relative velocity at X by, and what its rate does."""
    dr_i, dp_i = unit_change(k, BODY_I)
    dr_j, dp_j = unit_change(k, BODY_J)
    by_q = sub(_velocity_change(q, v, BODY_J, X, dX, dr_j, dp_j), _velocity_change(q, v, BODY_I, X, dX, dr_i, dp_i))
    return by_q, sub(
        _velocity_change_by_rates(q, BODY_J, X, dr_j, dp_j), _velocity_change_by_rates(q, BODY_I, X, dr_i, dp_i)
    )


@compiled
def damping_of(ip, par, u):
    """D [s/m]: a constant, or for an impact at the speed that an input gives."""
    if ip[1] > 0:
        return par[CONTACT.damping] / max(u[0, 0], SLOWEST_IMPACT)
    return par[CONTACT.damping]


@compiled
def input_change(par, u, depth, rate):
    """Derivative of N by the speed of the impact that an input gives: N = E (1 + d xdot / speed)."""
    speed = u[0, 0]
    if speed <= SLOWEST_IMPACT:
        return 0.0
    N, _, by_rate = normal_force(par[CONTACT.stiffness], par[CONTACT.damping] / speed, depth, rate)
    return -by_rate * rate / speed if N > 0.0 else 0.0


@compiled
def _put_force(out, q, X, F):
    """F on body j and -F on body i at X, into the rows of both."""
    for o, sign in ((BODY_I, -1.0), (BODY_J, 1.0)):
        load = spin_load(euler_parameters(q, o), cross(sub(X, vec(q, o)), F))
        for m in range(3):
            out[o + m] -= sign * F[m]
        for m in range(4):
            out[o + 3 + m] -= sign * load[m]


@compiled
def contact(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: shape, has an impact speed from an input."""
    shape, friction, slip_speed = ip[0], par[CONTACT.friction], par[CONTACT.slip_speed]
    g, n, X = touching(shape, par, q)
    if g >= 0.0:
        return
    w = relative_velocity(q, v, X)
    N, by_depth, by_rate = normal_force(par[CONTACT.stiffness], damping_of(ip, par, u), -g, -dot(n, w))
    if N <= 0.0:
        return
    F = contact_force(friction, slip_speed, N, n, w)
    _put_force(r, q, X, F)
    if level == 0:
        return
    zero, still = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)
    for k in range(14):
        dg, dn, dX = touch_change(shape, par, q, k)
        by_q, by_v = velocity_changes(q, v, X, dX, k)
        dN = -by_depth * dg - by_rate * (dot(dn, w) + dot(n, by_q))
        dF = contact_force_change(friction, slip_speed, N, n, w, dN, dn, by_q)
        dF_v = contact_force_change(friction, slip_speed, N, n, w, -by_rate * dot(n, by_v), zero, by_v)
        for o, sign in ((BODY_I, -1.0), (BODY_J, 1.0)):
            dr, dp = unit_change(k, o)
            _put_column(Jq, q, o, sign, X, F, dX, dF, dr, dp, k)
            _put_column(Jv, q, o, sign, X, F, zero, dF_v, zero, still, k)


@compiled
def contact_by_input(ip, par, q, v, a, u, Ju):
    """The rows by the speed of the impact, on which the damping depends."""
    g, n, X = touching(ip[0], par, q)
    if ip[1] == 0 or g >= 0.0:
        return
    w = relative_velocity(q, v, X)
    change = input_change(par, u, -g, -dot(n, w))
    _put_force(Ju[:, 0, 0], q, X, contact_force(par[CONTACT.friction], par[CONTACT.slip_speed], change, n, w))

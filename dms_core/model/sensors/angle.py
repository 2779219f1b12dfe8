"""Angle of a revolute joint with rate and acceleration (paper sect. 2.4, eq. 5; the exoskeleton's angle sensor).

    y = [theta,  theta_q v,  theta_q vdot + v^T theta_qq v]

theta = Im log z with z = c + i s (dms_core.model.geometry.angle). Along a motion

    thetaddot   = Im(zddot / z - (zdot / z)^2)
    thetaddot_q = Im(k2 zddot_q + k1 zdot_q + k0 z_q)
    k2 = 1 / z,   k1 = -2 zdot / z^2,   k0 = 2 zdot^2 / z^3 - zddot / z^2

where Im(k z) = (A_i m) . (A_j h) again, with m = Re(k) g + Im(k) f.
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Placement, Sensor, Vector
from dms_core.model.geometry.angle import ANGLE, add_angle_gradient, add_angle_rate_gradient, angle_rate, joint_angle
from dms_core.model.geometry.rotations import (
    add,
    bilinear,
    dot,
    euler_parameters,
    k_times,
    rotated,
    rotated_rate,
    scale,
    vec,
)
from dms_core.model.geometry.sensed_angle import sensed_angle


@compiled
def rotated_acceleration(q, v, a, o, s):
    """d2(A s)/dt2 for the body at offset o."""
    p, pd, pdd = euler_parameters(q, o), euler_parameters(v, o), euler_parameters(a, o)
    return scale(2.0, add(bilinear(p, pdd, s), bilinear(pd, pd, s)))


@compiled
def _course(oi, oj, m, h, q, v, a):
    """(A_i m) . (A_j h) with its first and second time derivative."""
    e, e1, e2 = rotated(q, oi, m), rotated_rate(q, v, oi, m), rotated_acceleration(q, v, a, oi, m)
    d, d1, d2 = rotated(q, oj, h), rotated_rate(q, v, oj, h), rotated_acceleration(q, v, a, oj, h)
    return dot(e, d), dot(e1, d) + dot(e, d1), dot(e2, d) + 2.0 * dot(e1, d1) + dot(e, d2)


@compiled
def _complex_course(oi, oj, f, g, h, q, v, a):
    """z, zdot, zddot."""
    c, s = _course(oi, oj, f, h, q, v, a), _course(oi, oj, g, h, q, v, a)
    return complex(c[0], s[0]), complex(c[1], s[1]), complex(c[2], s[2])


@compiled
def angle_acceleration(oi, oj, f, g, h, q, v, a):
    """theta_q vdot + v^T theta_qq v [rad/s^2]."""
    z, z1, z2 = _complex_course(oi, oj, f, g, h, q, v, a)
    return (z2 / z - (z1 / z) * (z1 / z)).imag


@compiled
def _add_first_body(k, oi, oj, m2, m1, m0, h, q, v, a, G):
    """Gradient by p_i of the courses of (A_i m) . (A_j h), each k-th time derivative with its own m."""
    d, d1, d2 = rotated(q, oj, h), rotated_rate(q, v, oj, h), rotated_acceleration(q, v, a, oj, h)
    p, pd, pdd = euler_parameters(q, oi), euler_parameters(v, oi), euler_parameters(a, oi)
    a2, a1, a0 = k_times(d, m2, pdd), k_times(d1, m2, pd), k_times(d2, m2, p)
    b1, b0 = k_times(d, m1, pd), k_times(d1, m1, p)
    c0 = k_times(d, m0, p)
    for n in range(4):
        G[k, oi + 3 + n] += 2.0 * (a2[n] + 2.0 * a1[n] + a0[n] + b1[n] + b0[n] + c0[n])


@compiled
def _add_second_body(k, oi, oj, m2, m1, m0, h, q, v, a, G):
    """The same by p_j; K(w, h) is linear in w, which saves half of the products."""
    w2 = rotated(q, oi, m2)
    w1 = add(scale(2.0, rotated_rate(q, v, oi, m2)), rotated(q, oi, m1))
    w0 = add(rotated_acceleration(q, v, a, oi, m2), add(rotated_rate(q, v, oi, m1), rotated(q, oi, m0)))
    x2 = k_times(w2, h, euler_parameters(a, oj))
    x1 = k_times(w1, h, euler_parameters(v, oj))
    x0 = k_times(w0, h, euler_parameters(q, oj))
    for n in range(4):
        G[k, oj + 3 + n] += 2.0 * (x2[n] + x1[n] + x0[n])


@compiled
def add_angle_acceleration_gradient(k, oi, oj, f, g, h, q, v, a, G):
    """G[k, :] += thetaddot_q."""
    z, z1, z2 = _complex_course(oi, oj, f, g, h, q, v, a)
    k2 = 1.0 / z
    k1 = -2.0 * z1 * k2 * k2
    k0 = (2.0 * z1 * z1 * k2 - z2) * k2 * k2
    m2 = add(scale(k2.real, g), scale(k2.imag, f))
    m1 = add(scale(k1.real, g), scale(k1.imag, f))
    m0 = add(scale(k0.real, g), scale(k0.imag, f))
    _add_first_body(k, oi, oj, m2, m1, m0, h, q, v, a, G)
    _add_second_body(k, oi, oj, m2, m1, m0, h, q, v, a, G)


@compiled
def joint_angle_sensor(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """par: f, g, h of dms_core.model.geometry.angle."""
    f, g, h = vec(par, ANGLE.f), vec(par, ANGLE.g), vec(par, ANGLE.h)
    y[0] = joint_angle(0, 7, f, g, h, q)
    y[1] = angle_rate(0, 7, f, g, h, q, v)
    y[2] = angle_acceleration(0, 7, f, g, h, q, v, a)
    if level > 0:
        add_angle_gradient(0, 0, 7, f, g, h, q, 1.0, Yq)
        add_angle_rate_gradient(1, 0, 7, f, g, h, q, v, 1.0, Yq)
        add_angle_gradient(1, 0, 7, f, g, h, q, 1.0, Yv)
        add_angle_acceleration_gradient(2, 0, 7, f, g, h, q, v, a, Yq)
        add_angle_rate_gradient(2, 0, 7, f, g, h, q, v, 2.0, Yv)
        add_angle_gradient(2, 0, 7, f, g, h, q, 1.0, Ya)


class JointAngle(Sensor):
    """Angle of body_j against body_i of a joint about an axis, positive about its axis, in (-pi, pi].

    Without pointers it is 0 where the reference frames of both bodies are parallel. An angle that goes on beyond half a
    turn is the coordinate of a `turn_counter`.
    """

    kind: ClassVar[str] = "joint_angle"
    kernel: ClassVar = joint_angle_sensor
    joint: str = Field(description="name of the joint")
    pointer_i: Vector | None = Field(default=None, description="direction of angle 0 in the frame of body_i [-]")
    pointer_j: Vector | None = Field(
        default=None, description="direction in the frame of body_j that lies along pointer_i at angle 0 [-]"
    )

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Angle, rate and acceleration."""
        return (("angle", "rad"), ("rate", "rad/s"), ("acceleration", "rad/s^2"))

    def place(self, system) -> Placement:
        """Both bodies of the joint."""
        who = f"{self.kind} '{self.name}'"
        bodies, numbers = sensed_angle(system, who, self.joint, self.pointer_i, self.pointer_j)
        return Placement(bodies=bodies, numbers=numbers)

"""The angle between two bodies about an axis of body i: one geometry for sensors, drivers, springs, controllers.

    theta = atan2(s, c),   c = (A_i f) . (A_j h),   s = (A_i g) . (A_j h)

f and g are perpendicular to each other and to the axis f x g, in body i; h is the pointer in body j, so that
theta = 0 where A_j h is along A_i f. Written as theta = Im log(c + i s):

    theta_q  = b,    theta_qq = (c s_qq - s c_qq) / D - (a b^T + b a^T),    D = c^2 + s^2
    b = (c s_q - s c_q) / D,   a = (c c_q + s s_q) / D
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.geometry.frames import perpendicular, unit
from dms_core.model.geometry.rotations import (
    add,
    add_cross_hessian,
    add_hessian,
    dot,
    euler_parameters,
    k_times,
    rotated,
    rotated_rate,
    scale,
    sub,
)


class AngleNumbers(NamedTuple):
    """Places of the directions in a table that holds nothing but an angle's frame."""

    f: int = 0
    g: int = 3
    h: int = 6


ANGLE = AngleNumbers()

LEAST_LEVER = 1e-3
"""Sine of the angle between pointer and axis [-] below which a pointer shows no angle."""


@compiled
def joint_angle(oi, oj, f, g, h, q):
    """theta [rad], in (-pi, pi]."""
    d = rotated(q, oj, h)
    return math.atan2(dot(rotated(q, oi, g), d), dot(rotated(q, oi, f), d))


@compiled
def angle_directions(oi, oj, f, g, h, q):
    """(m, n): vectors of body i such that b is the gradient of (A_i m).(A_j h), and a that of (A_i n).(A_j h)."""
    d = rotated(q, oj, h)
    c, s = dot(rotated(q, oi, f), d), dot(rotated(q, oi, g), d)
    D = c * c + s * s
    return scale(1.0 / D, sub(scale(c, g), scale(s, f))), scale(1.0 / D, add(scale(c, f), scale(s, g)))


@compiled
def _gradient(oi, oj, m, h, q):
    """2 K p of (A_i m).(A_j h) for both bodies: two 4-tuples."""
    return (
        k_times(rotated(q, oj, h), m, euler_parameters(q, oi)),
        k_times(rotated(q, oi, m), h, euler_parameters(q, oj)),
    )


@compiled
def half_angle_gradient(oi, oj, f, g, h, q):
    """theta_q / 2 by the Euler parameters of both bodies: two 4-tuples."""
    m, _ = angle_directions(oi, oj, f, g, h, q)
    return _gradient(oi, oj, m, h, q)


@compiled
def angle_rate(oi, oj, f, g, h, q, v):
    """theta_q v [rad/s]."""
    gi, gj = half_angle_gradient(oi, oj, f, g, h, q)
    rate = 0.0
    for k in range(4):
        rate += 2.0 * (gi[k] * v[oi + 3 + k] + gj[k] * v[oj + 3 + k])
    return rate


@compiled
def add_angle_gradient(k, oi, oj, f, g, h, q, factor, G):
    """G[k, :] += factor theta_q."""
    gi, gj = half_angle_gradient(oi, oj, f, g, h, q)
    for n in range(4):
        G[k, oi + 3 + n] += 2.0 * factor * gi[n]
        G[k, oj + 3 + n] += 2.0 * factor * gj[n]


@compiled
def add_angle_hessian(oi, oj, f, g, h, q, factor, H):
    """H[:, :] += factor theta_qq."""
    m, n = angle_directions(oi, oj, f, g, h, q)
    bi, bj = _gradient(oi, oj, m, h, q)
    ai, aj = _gradient(oi, oj, n, h, q)
    add_hessian(H, oi, rotated(q, oj, h), m, factor)
    add_hessian(H, oj, rotated(q, oi, m), h, factor)
    add_cross_hessian(H, q, oi, m, oj, h, factor)
    for k in range(4):
        for j in range(4):
            H[oi + 3 + k, oi + 3 + j] -= 4.0 * factor * (ai[k] * bi[j] + bi[k] * ai[j])
            H[oj + 3 + k, oj + 3 + j] -= 4.0 * factor * (aj[k] * bj[j] + bj[k] * aj[j])
            x = 4.0 * factor * (ai[k] * bj[j] + bi[k] * aj[j])
            H[oi + 3 + k, oj + 3 + j] -= x
            H[oj + 3 + j, oi + 3 + k] -= x


@compiled
def add_angle_rate_gradient(k, oi, oj, f, g, h, q, v, factor, W):
    """W[k, :] += factor (theta_q v)_q = factor theta_qq v."""
    m, n = angle_directions(oi, oj, f, g, h, q)
    d = rotated(q, oj, h)
    e = rotated(q, oi, m)
    vi, vj = euler_parameters(v, oi), euler_parameters(v, oj)
    bi, bj = _gradient(oi, oj, m, h, q)
    ai, aj = _gradient(oi, oj, n, h, q)
    hi, hj = k_times(d, m, vi), k_times(e, h, vj)
    di, dj = rotated_rate(q, v, oi, m), rotated_rate(q, v, oj, h)
    ci, cj = k_times(dj, m, euler_parameters(q, oi)), k_times(di, h, euler_parameters(q, oj))
    av, bv = 0.0, 0.0
    for i in range(4):
        av += 2.0 * (ai[i] * vi[i] + aj[i] * vj[i])
        bv += 2.0 * (bi[i] * vi[i] + bj[i] * vj[i])
    for i in range(4):
        W[k, oi + 3 + i] += 2.0 * factor * (hi[i] + ci[i] - ai[i] * bv - bi[i] * av)
        W[k, oj + 3 + i] += 2.0 * factor * (hj[i] + cj[i] - aj[i] * bv - bj[i] * av)


def angle_frame(system, who: str, joint, pointer_i=None, pointer_j=None) -> np.ndarray:
    """f, g, h for the kernels above, shape (9,), of a revolute joint.

    `pointer_i` is a direction in body_i made perpendicular to the joint's axis (default: any), and `pointer_j` the
    direction in body_j that lies along it at angle 0. Without `pointer_j` the angle is 0 where the two reference frames
    are parallel, which is the custom of anatomical joints whose bodies share axes.
    """
    axis = unit(joint.axis_i, f"{who}: axis_i")
    f = (
        perpendicular(axis)
        if pointer_i is None
        else np.asarray(pointer_i, float) - axis * (axis @ np.asarray(pointer_i, float))
    )
    f = unit(f, f"{who}: pointer_i (its part perpendicular to the axis)")
    h = f if pointer_j is None else unit(pointer_j, f"{who}: pointer_j")
    axis_j = joint.axis_j if joint.axis_j is not None else system.start_direction(joint.body_i, axis, joint.body_j)
    if np.linalg.norm(np.cross(unit(axis_j, f"{who}: axis_j"), h)) < LEAST_LEVER:
        raise ModelError(
            f"{who}: pointer_j = {tuple(map(float, h))}{'' if pointer_j is not None else ' (that of body_i)'} lies "
            f"along the axis of '{joint.name}' in '{joint.body_j}' and shows no angle; give one across that axis."
        )
    return np.concatenate([f, np.cross(axis, f), h])


def start_frame(system, joint, f=None) -> np.ndarray:
    """f, g, h, shape (9,), of a joint about an axis, with angle 0 at the declared start.

    Args:
        system: the declared system.
        joint: with body_i, body_j and axes.
        f: direction across the axis in body_i; default: any.
    """
    axis, axis_j = joint.axes(system)
    f = perpendicular(axis) if f is None else f
    h = system.start_direction(joint.body_i, f, joint.body_j)
    h = h - axis_j * (axis_j @ h)
    if np.linalg.norm(h) < LEAST_LEVER:
        raise ModelError(
            f"{joint.kind} '{joint.name}': axis_i of '{joint.body_i}' and axis_j of '{joint.body_j}' are at right "
            "angles at the declared start, so that the joint shows no angle there. Expected start poses with both axes "
            "along each other."
        )
    return np.concatenate([f, np.cross(axis, f), h / np.linalg.norm(h)])


def start_angle(system, joint, frame: np.ndarray) -> float:
    """Angle in a frame f, g, h at the declared start [rad], in (-pi, pi]."""
    d = system.start_direction(joint.body_j, frame[6:], joint.body_i)
    return math.atan2(frame[3:6] @ d, frame[:3] @ d)

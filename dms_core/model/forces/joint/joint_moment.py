"""A moment M(theta, thetadot) about a revolute joint: the row terms M theta_q^T and their derivatives.

    (M theta_q^T)_q = M theta_qq + theta_q^T (M_theta theta_q + M_rate (theta_q v)_q),   (M theta_q^T)_v = M_rate b b^T

with b = theta_q^T. Springs, dampers and stops say what M is; everything else about the joint is here.
"""

from __future__ import annotations

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.model.element import Pattern
from dms_core.model.geometry.angle import add_angle_hessian, add_angle_rate_gradient, half_angle_gradient


@compiled
def angle_gradient(f, g, h, q):
    """theta_q by the Euler parameters of both bodies: an 8-tuple."""
    x, y = half_angle_gradient(0, 7, f, g, h, q)
    return (
        2.0 * x[0], 2.0 * x[1], 2.0 * x[2], 2.0 * x[3], 2.0 * y[0], 2.0 * y[1], 2.0 * y[2], 2.0 * y[3],
    )  # fmt: skip


@compiled
def local_parameter(i):
    """Local coordinate of entry i of the 8-tuple."""
    return 3 + i if i < 4 else 6 + i


@compiled
def _angle_rate_gradient(f, g, h, q, v, Jq):
    """(theta_q v)_q as an 8-tuple; row 3 of Jq, still zero, is borrowed and given back as zero."""
    add_angle_rate_gradient(3, 0, 7, f, g, h, q, v, 1.0, Jq)
    w = (Jq[3, 3], Jq[3, 4], Jq[3, 5], Jq[3, 6], Jq[3, 10], Jq[3, 11], Jq[3, 12], Jq[3, 13])
    for i in range(8):
        Jq[3, local_parameter(i)] = 0.0
    return w


@compiled
def put_joint_moment(f, g, h, q, v, M, by_angle, by_rate, level, r, Jq, Jv):
    """Fill r, Jq, Jv, which are still zero, with the terms of a moment that resists the joint's turning.

    Args:
        f: first direction of the angle's frame, see dms_core.model.geometry.angle.
        g: second direction.
        h: pointer in the second body.
        q: local coordinates of both bodies.
        v: their rates.
        M: moment against a positive turn [N m].
        by_angle: its derivative by the angle [N m/rad].
        by_rate: its derivative by the angle's rate [N m s/rad].
        level: 0 for values, 1 for values and derivatives.
        r: row terms.
        Jq: their derivatives by q.
        Jv: their derivatives by v.
    """
    b = angle_gradient(f, g, h, q)
    for i in range(8):
        r[local_parameter(i)] += M * b[i]
    if level > 0:
        w = _angle_rate_gradient(f, g, h, q, v, Jq)
        add_angle_hessian(0, 7, f, g, h, q, M, Jq)
        for i in range(8):
            for j in range(8):
                Jq[local_parameter(i), local_parameter(j)] += b[i] * (by_angle * b[j] + by_rate * w[j])
                Jv[local_parameter(i), local_parameter(j)] += by_rate * b[i] * b[j]


def joint_moment_pattern(damped: bool) -> Pattern:
    """Where the derivatives of `put_joint_moment` can be non-zero; `damped`: the moment depends on the angle's rate."""
    p = np.arange(14) % 7 >= 3
    full, none = np.outer(p, p), np.zeros((14, 14), bool)
    return Pattern(full, full if damped else none, none)

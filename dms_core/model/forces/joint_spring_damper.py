"""Spring and damper about a revolute joint.

    M = k (theta - theta0) + c thetadot,   Q = -M theta_q^T

With stiffness 0 it is the joint's viscous damping.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.revolute import Revolute
from dms_core.model.element import Force, Pattern, Placement, Vector
from dms_core.model.geometry.angle import (
    add_angle_hessian,
    add_angle_rate_gradient,
    angle_directions,
    angle_frame,
    angle_rate,
    joint_angle,
)
from dms_core.model.geometry.rotations import euler_parameters, k_times, rotated, vec
from dms_core.model.places import numbers_at


class JointSpringNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    f: int = 0
    """Frame of the angle, see dms_core.model.geometry.angle."""
    g: int = 3
    h: int = 6
    stiffness: int = 9
    damping: int = 10
    rest_angle: int = 11


JOINT_SPRING = JointSpringNumbers()


@compiled
def _angle_gradient(f, g, h, q):
    """theta_q by the Euler parameters of both bodies: an 8-tuple."""
    m, _ = angle_directions(0, 7, f, g, h, q)
    x = k_times(rotated(q, 7, h), m, euler_parameters(q, 0))
    y = k_times(rotated(q, 0, m), h, euler_parameters(q, 7))
    return (
        2.0 * x[0], 2.0 * x[1], 2.0 * x[2], 2.0 * x[3], 2.0 * y[0], 2.0 * y[1], 2.0 * y[2], 2.0 * y[3],
    )  # fmt: skip


@compiled
def _place(i):
    """Local coordinate of entry i of the 8-tuple."""
    return 3 + i if i < 4 else 6 + i


@compiled
def _angle_rate_gradient(f, g, h, q, v, Jq):
    """(theta_q v)_q as an 8-tuple; row 3 of Jq, still zero, is borrowed and given back as zero."""
    add_angle_rate_gradient(3, 0, 7, f, g, h, q, v, 1.0, Jq)
    w = (Jq[3, 3], Jq[3, 4], Jq[3, 5], Jq[3, 6], Jq[3, 10], Jq[3, 11], Jq[3, 12], Jq[3, 13])
    for i in range(8):
        Jq[3, _place(i)] = 0.0
    return w


@compiled
def joint_spring_damper(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """Row terms M theta_q^T."""
    f, g, h = vec(par, JOINT_SPRING.f), vec(par, JOINT_SPRING.g), vec(par, JOINT_SPRING.h)
    k, c = par[JOINT_SPRING.stiffness], par[JOINT_SPRING.damping]
    turn = 2.0 * math.pi
    twist = joint_angle(0, 7, f, g, h, q) - par[JOINT_SPRING.rest_angle]
    # theta jumps by a turn at +-pi; the spring is wound the short way round.
    twist -= turn * math.floor(twist / turn + 0.5)
    M = k * twist + c * angle_rate(0, 7, f, g, h, q, v)
    b = _angle_gradient(f, g, h, q)
    for i in range(8):
        r[_place(i)] += M * b[i]
    if level > 0:
        w = _angle_rate_gradient(f, g, h, q, v, Jq)
        add_angle_hessian(0, 7, f, g, h, q, M, Jq)
        for i in range(8):
            for j in range(8):
                Jq[_place(i), _place(j)] += b[i] * (k * b[j] + c * w[j])
                Jv[_place(i), _place(j)] += c * b[i] * b[j]


class JointSpringDamper(Force):
    """Linear torsion spring and damper about a revolute joint. The angle stays within half a turn of the rest angle."""

    kind: ClassVar[str] = "joint_spring_damper"
    kernel: ClassVar = joint_spring_damper
    joint: str = Field(description="revolute joint")
    stiffness: float = Field(default=0.0, ge=0.0, description="k [N m/rad]")
    damping: float = Field(default=0.0, ge=0.0, description="c [N m s/rad]")
    rest_angle: float = Field(default=0.0, description="theta0, where the spring is slack [rad]")
    pointer_i: Vector | None = Field(default=None, description="direction in body_i [-]; default: any, see angle_frame")
    pointer_j: Vector | None = Field(default=None, description="direction in body_j that lies along it at angle 0 [-]")

    def place(self, system) -> Placement:
        """Both bodies of the joint and the angle's frame."""
        joint = system.element(self.joint, Revolute)
        who = f"joint_spring_damper '{self.name}'"
        frame = angle_frame(system, who, joint, self.pointer_i, self.pointer_j)
        p = np.arange(14) % 7 >= 3
        full, none = np.outer(p, p), np.zeros((14, 14), bool)
        return Placement(
            bodies=(joint.body_i, joint.body_j),
            numbers=numbers_at(
                JOINT_SPRING,
                f=frame[:3],
                g=frame[3:6],
                h=frame[6:],
                stiffness=self.stiffness,
                damping=self.damping,
                rest_angle=self.rest_angle,
            ),  # fmt: skip
            pattern=Pattern(full, full if self.damping > 0.0 else none, none),
        )

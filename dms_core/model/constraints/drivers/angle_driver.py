"""Rheonomic constraint on a joint angle: it follows an input. One row.

    theta(q) - u(t) = 0,   phi_t = -udot,   phi_tt = -uddot

Its multiplier is the drive's moment about the joint [N m]: -lam acts in the sense of growing theta.
"""

from __future__ import annotations

import math
from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.constraints.primitives import joint_pattern
from dms_core.model.element import Constraint, Placement, Vector
from dms_core.model.geometry.angle import (
    ANGLE,
    add_angle_gradient,
    add_angle_hessian,
    add_angle_rate_gradient,
    angle_frame,
    joint_angle,
)
from dms_core.model.geometry.rotations import vec


@compiled
def angle_driver(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """par: f, g, h of the angle."""
    f, g, h = vec(par, ANGLE.f), vec(par, ANGLE.g), vec(par, ANGLE.h)
    turn = 2.0 * math.pi
    error = joint_angle(0, 7, f, g, h, q) - u[0, 0]
    # theta jumps by a turn at +-pi, the input does not: the error is the short way round.
    phi[0] = error - turn * math.floor(error / turn + 0.5)
    phi_t[0, 0] = -u[0, 1]
    phi_t[0, 1] = -u[0, 2]
    add_angle_gradient(0, 0, 7, f, g, h, q, 1.0, G)
    if level > 0:
        add_angle_rate_gradient(0, 0, 7, f, g, h, q, v, 1.0, W)
        add_angle_hessian(0, 7, f, g, h, q, lam[0], H)


class AngleDriver(Constraint):
    """The angle of a joint about an axis follows an input [rad]."""

    kind: ClassVar[str] = "angle_driver"
    kernel: ClassVar = angle_driver
    joint: str = Field(description="joint about an axis")
    input: str = Field(description="input that gives the angle [rad]; it must be twice differentiable")
    pointer_i: Vector | None = Field(default=None, description="direction in body_i [-]; default: any, see angle_frame")
    pointer_j: Vector | None = Field(default=None, description="direction in body_j that lies along it at angle 0 [-]")

    def rows(self) -> tuple[str, ...]:
        """Angle minus input [rad]."""
        return ("angle",)

    def governs(self) -> str:
        """An angle can be driven once."""
        return f"the angle of '{self.joint}'"

    def place(self, system) -> Placement:
        """Both bodies of the joint, the angle's frame, the input."""
        joint = system.element(self.joint, AxisJoint)
        who = f"angle_driver '{self.name}'"
        frame = angle_frame(system, who, joint, self.pointer_i, self.pointer_j)
        return Placement(
            bodies=(joint.body_i, joint.body_j), inputs=(self.input,), numbers=tuple(frame), pattern=joint_pattern("1")
        )

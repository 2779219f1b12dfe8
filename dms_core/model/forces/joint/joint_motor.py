"""Motor on a joint that gives a prescribed moment: Q = u theta_q^T.

A motor whose angle is prescribed is an `angle_driver`; its multiplier is the moment that this takes.
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.element import Force, Placement
from dms_core.model.forces.joint.joint_moment import (
    angle_gradient,
    joint_moment_pattern,
    local_parameter,
    put_joint_moment,
)
from dms_core.model.geometry.angle import ANGLE, start_frame
from dms_core.model.geometry.rotations import vec


@compiled
def joint_motor(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """par: f, g, h of the angle. Row terms -u theta_q^T."""
    f, g, h = vec(par, ANGLE.f), vec(par, ANGLE.g), vec(par, ANGLE.h)
    put_joint_moment(f, g, h, q, v, -u[0, 0], 0.0, 0.0, level, r, Jq, Jv)


@compiled
def joint_motor_by_input(ip, par, q, v, a, u, Ju):
    """The rows by the moment: -theta_q^T."""
    b = angle_gradient(vec(par, ANGLE.f), vec(par, ANGLE.g), vec(par, ANGLE.h), q)
    for i in range(8):
        Ju[local_parameter(i), 0, 0] = -b[i]


class JointMotor(Force):
    """Motor whose moment is an input: it turns body_j of a joint about the axis, and body_i against it."""

    kind: ClassVar[str] = "joint_motor"
    kernel: ClassVar = joint_motor
    input_kernel: ClassVar = joint_motor_by_input
    joint: str = Field(description="joint about an axis")
    input: str = Field(description="input that gives the moment on body_j about the joint's axis [N m]")

    def input_names(self) -> tuple[str, ...]:
        """The moment."""
        return (self.input,)

    def place(self, system) -> Placement:
        """Both bodies of the joint and the angle's frame."""
        joint = system.element(self.joint, AxisJoint)
        return Placement(
            bodies=(joint.body_i, joint.body_j),
            inputs=(self.input,),
            numbers=tuple(map(float, start_frame(system, joint))),
            pattern=joint_moment_pattern(damped=False),
        )

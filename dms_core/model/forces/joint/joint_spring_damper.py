"""Spring and damper at a joint.

    M = k (theta - theta0) + c thetadot,   Q = -M theta_q^T

With stiffness 0 it is the joint's viscous damping.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.element import Force, Placement, Vector
from dms_core.model.forces.joint.joint_moment import joint_moment_pattern, put_joint_moment
from dms_core.model.geometry.angle import angle_frame, angle_rate, joint_angle
from dms_core.model.geometry.rotations import vec
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
def joint_spring_damper(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """Row terms M theta_q^T."""
    f, g, h = vec(par, JOINT_SPRING.f), vec(par, JOINT_SPRING.g), vec(par, JOINT_SPRING.h)
    k, c = par[JOINT_SPRING.stiffness], par[JOINT_SPRING.damping]
    turn = 2.0 * math.pi
    twist = joint_angle(0, 7, f, g, h, q) - par[JOINT_SPRING.rest_angle]
    # theta jumps by a turn at +-pi; the spring is wound the short way round.
    twist -= turn * math.floor(twist / turn + 0.5)
    M = k * twist + c * angle_rate(0, 7, f, g, h, q, v)
    put_joint_moment(f, g, h, q, v, M, k, c, level, r, Jq, Jv)


class JointSpringDamper(Force):
    """Linear torsion spring and damper at a joint. The angle stays within half a turn of the rest angle."""

    kind: ClassVar[str] = "joint_spring_damper"
    kernel: ClassVar = joint_spring_damper
    joint: str = Field(description="joint about an axis")
    stiffness: float = Field(default=0.0, ge=0.0, description="k [N m/rad]")
    damping: float = Field(default=0.0, ge=0.0, description="c [N m s/rad]")
    rest_angle: float = Field(default=0.0, description="theta0, where the spring is slack [rad]")
    pointer_i: Vector | None = Field(default=None, description="direction in body_i [-]; default: any, see angle_frame")
    pointer_j: Vector | None = Field(default=None, description="direction in body_j that lies along it at angle 0 [-]")

    def place(self, system) -> Placement:
        """Both bodies of the joint and the angle's frame."""
        joint = system.element(self.joint, AxisJoint)
        who = f"joint_spring_damper '{self.name}'"
        frame = angle_frame(system, who, joint, self.pointer_i, self.pointer_j)
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
            pattern=joint_moment_pattern(self.damping > 0.0),
        )

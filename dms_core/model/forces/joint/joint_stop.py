"""Stops of a joint: beyond a lowest and a highest angle, the contact of Hunt and Crossley about the angle.

With the depth x > 0 beyond a stop, and xdot its rate:

    M = k x^(3/2) (1 + 3/2 c xdot), at least 0

It turns the joint back: Q = -M theta_q^T beyond the highest angle, M theta_q^T below the lowest.

The law is that of K. H. Hunt and F. R. E. Crossley (1975), J. Appl. Mech. 42:440-445; its exponent is that of a
Hertzian contact, with which M and its derivatives begin at 0, so that a step over the touch meets no kink. A stop never
pulls. Speeds vi before and vo after an impact in which nothing else acts follow from c alone:

    a (vi + vo) = ln((1 + a vi) / (1 - a vo)),   a = 3/2 c,   vo / vi = 1 - c vi + ... for small c vi

With c = 0 the energy 2/5 k x^(5/2) is given back.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple, Self

from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.contact.law import normal_force
from dms_core.model.element import Force, Placement, Vector
from dms_core.model.forces.joint.joint_moment import joint_moment_pattern, put_joint_moment
from dms_core.model.geometry.angle import angle_frame, angle_rate, joint_angle
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at

TURN = 2.0 * math.pi


class JointStopNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    f: int = 0
    """Frame of the angle, see dms_core.model.geometry.angle."""
    g: int = 3
    h: int = 6
    lowest: int = 9
    highest: int = 10
    stiffness: int = 11
    dissipation: int = 12


JOINT_STOP = JointStopNumbers()


@compiled
def joint_stop(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """Row terms of the stop that is touched; nothing between the stops."""
    f, g, h = vec(par, JOINT_STOP.f), vec(par, JOINT_STOP.g), vec(par, JOINT_STOP.h)
    low, high = par[JOINT_STOP.lowest], par[JOINT_STOP.highest]
    off = joint_angle(0, 7, f, g, h, q) - 0.5 * (low + high)
    # theta jumps by a turn at +-pi; the nearer stop is the one that is touched.
    off -= TURN * math.floor(off / TURN + 0.5)
    depth, way = abs(off) - 0.5 * (high - low), math.copysign(1.0, off)
    if depth > 0.0:
        k, damping = par[JOINT_STOP.stiffness], 1.5 * par[JOINT_STOP.dissipation]
        M, by_depth, by_rate = normal_force(k, damping, depth, way * angle_rate(0, 7, f, g, h, q, v))
        if M > 0.0:
            put_joint_moment(f, g, h, q, v, way * M, by_depth, by_rate, level, r, Jq, Jv)


class JointStop(Force):
    """Lowest and highest angle of a joint, each a stop that yields; between them nothing acts."""

    kind: ClassVar[str] = "joint_stop"
    kernel: ClassVar = joint_stop
    joint: str = Field(description="joint about an axis")
    lowest: float = Field(description="angle below which a stop is touched [rad]")
    highest: float = Field(description="angle above which a stop is touched [rad]; less than a turn above the lowest")
    stiffness: float = Field(gt=0.0, description="k of both stops [N m/rad^1.5]")
    dissipation: float = Field(
        default=0.0, ge=0.0, description="c [s/rad]; an impact at a small rate w gives back 1 - c w of it"
    )
    pointer_i: Vector | None = Field(default=None, description="direction in body_i [-]; default: any, see angle_frame")
    pointer_j: Vector | None = Field(default=None, description="direction in body_j that lies along it at angle 0 [-]")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.lowest < self.highest < self.lowest + TURN:
            raise ValueError(
                f"lowest = {self.lowest:g}, highest = {self.highest:g}: expected the lowest angle below the highest, "
                "and less than a turn (6.28319 rad) between them"
            )
        return self

    def place(self, system) -> Placement:
        """Both bodies of the joint and the angle's frame."""
        joint = system.element(self.joint, AxisJoint)
        frame = angle_frame(system, f"joint_stop '{self.name}'", joint, self.pointer_i, self.pointer_j)
        return Placement(
            bodies=(joint.body_i, joint.body_j),
            numbers=numbers_at(
                JOINT_STOP,
                f=frame[:3],
                g=frame[3:6],
                h=frame[6:],
                lowest=self.lowest,
                highest=self.highest,
                stiffness=self.stiffness,
                dissipation=self.dissipation,
            ),  # fmt: skip
            pattern=joint_moment_pattern(self.dissipation > 0.0),
        )

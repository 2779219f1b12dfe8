"""Screw joint: body_j turns about an axis of body_i and moves along it by the lead with each turn. Five rows.

    the four rows of a cylindrical joint
    (A_i a_i) . d - lead theta / (2 pi) = 0        d = r_j + A_j s_j - r_i - A_i s_i

theta counts from the declared start. It is known but for whole turns, and so is the last row but for whole leads: the
one nearest to 0 is taken, which is right after any number of turns.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field, field_validator

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AXIS, AxisJoint
from dms_core.model.constraints.joints.cylindrical import cylindrical
from dms_core.model.constraints.joints.relative_pose import second_point
from dms_core.model.constraints.primitives import dot2, joint_pattern
from dms_core.model.element import Placement
from dms_core.model.geometry.angle import (
    add_angle_gradient,
    add_angle_hessian,
    add_angle_rate_gradient,
    joint_angle,
    start_frame,
)
from dms_core.model.geometry.rotations import cross, vec
from dms_core.model.places import numbers_at


class ScrewNumbers(NamedTuple):
    """Places of the kernel's numbers: those of a joint about an axis, then those of the thread."""

    s_i: int = AXIS.s_i
    s_j: int = AXIS.s_j
    f_i: int = AXIS.f_i
    g_i: int = AXIS.g_i
    a_j: int = AXIS.a_j
    h_j: int = 15
    """Direction of the second body that lies along f_i at the start."""
    start: int = 18
    """Way along the axis at the start [m]."""
    lead: int = 19
    """[m]."""


SCREW = ScrewNumbers()


@compiled
def screw(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    cylindrical(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H)
    s_i, s_j, lead = vec(par, SCREW.s_i), vec(par, SCREW.s_j), par[SCREW.lead]
    f, g, h = vec(par, SCREW.f_i), vec(par, SCREW.g_i), vec(par, SCREW.h_j)
    dot2(4, 0, 7, cross(f, g), s_i, s_j, q, v, lam, level, phi, G, W, H)
    per_radian = lead / (2.0 * math.pi)
    error = phi[4] - par[SCREW.start] - per_radian * joint_angle(0, 7, f, g, h, q)
    phi[4] = error - lead * math.floor(error / lead + 0.5)
    add_angle_gradient(4, 0, 7, f, g, h, q, -per_radian, G)
    if level > 0:
        add_angle_rate_gradient(4, 0, 7, f, g, h, q, v, -per_radian, W)
        add_angle_hessian(0, 7, f, g, h, q, -per_radian * lam[4], H)


class Screw(AxisJoint):
    """Nut on a screw: body_j moves by `lead` along axis_i with each positive turn about it.

    What is not given of body_j is taken from the declared start poses. A left-handed thread has a negative lead.
    """

    kind: ClassVar[str] = "screw"
    kernel: ClassVar = screw
    lead: float = Field(description="way along the axis with one turn [m]; negative for a left-handed thread")

    @field_validator("lead")
    @classmethod
    def _moves(cls, lead: float) -> float:
        if lead == 0.0:
            raise ValueError("Expected a lead other than 0; use a revolute joint for a nut that does not move")
        return lead

    def rows(self) -> tuple[str, ...]:
        """Distances from the axis along f and g, the two components of tilt, then the thread."""
        return ("off_f", "off_g", "tilt_f", "tilt_g", "thread")

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        own = self.axis_numbers(system)
        axis, f = np.cross(own["f_i"], own["g_i"]), own["f_i"]
        frame = start_frame(system, self, f)
        there = system.start_point(self.body_j, second_point(system, self), self.body_i)
        start = float(axis @ (there - np.asarray(self.point_i)))
        numbers = numbers_at(SCREW, **own, h_j=frame[6:], start=start, lead=self.lead)
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("22112"))

"""Revolute joint: two bodies share a point and an axis. Five rows.

r_i + A_i s_i - r_j - A_j s_j = 0                  (3)
(A_i f_i) . (A_j a_j) = 0,  (A_i g_i) . (A_j a_j) = 0      f_i, g_i perpendicular to a_i   (2)
"""

from __future__ import annotations

from typing import ClassVar

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AXIS, AxisJoint
from dms_core.model.constraints.primitives import coincidence, dot1, joint_pattern
from dms_core.model.element import Placement
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at


@compiled
def revolute(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    coincidence(0, 0, 7, vec(par, AXIS.s_i), vec(par, AXIS.s_j), q, v, lam, level, phi, G, W, H)
    dot1(3, 0, 7, vec(par, AXIS.f_i), vec(par, AXIS.a_j), 0.0, q, v, lam, level, phi, G, W, H)
    dot1(4, 0, 7, vec(par, AXIS.g_i), vec(par, AXIS.a_j), 0.0, q, v, lam, level, phi, G, W, H)


class Revolute(AxisJoint):
    """Hinge between body_i and body_j. What is not given of body_j is taken from the declared start poses."""

    kind: ClassVar[str] = "revolute"
    kernel: ClassVar = revolute

    def rows(self) -> tuple[str, ...]:
        """Coincidence in ground axes, then the two components of tilt."""
        return ("x", "y", "z", "tilt_f", "tilt_g")

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        numbers = numbers_at(AXIS, **self.axis_numbers(system))
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("ccc11"))

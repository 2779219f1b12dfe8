"""Cylindrical joint: body_j turns about an axis of body_i and slides along it. Four rows.

(A_i f_i) . d = 0,  (A_i g_i) . d = 0                       d = r_j + A_j s_j - r_i - A_i s_i   (2)
(A_i f_i) . (A_j a_j) = 0,  (A_i g_i) . (A_j a_j) = 0       f_i, g_i perpendicular to a_i       (2)
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AXIS, AxisJoint
from dms_core.model.constraints.primitives import dot1, dot2, joint_pattern
from dms_core.model.element import Placement, Vector
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at


@compiled
def cylindrical(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    s_i, s_j, a = vec(par, AXIS.s_i), vec(par, AXIS.s_j), vec(par, AXIS.a_j)
    f, g = vec(par, AXIS.f_i), vec(par, AXIS.g_i)
    dot2(0, 0, 7, f, s_i, s_j, q, v, lam, level, phi, G, W, H)
    dot2(1, 0, 7, g, s_i, s_j, q, v, lam, level, phi, G, W, H)
    dot1(2, 0, 7, f, a, 0.0, q, v, lam, level, phi, G, W, H)
    dot1(3, 0, 7, g, a, 0.0, q, v, lam, level, phi, G, W, H)


class Cylindrical(AxisJoint):
    """Sleeve on a shaft: body_j turns about the axis through point_i of body_i and slides along it.

    What is not given of body_j is taken from the declared start poses.
    """

    kind: ClassVar[str] = "cylindrical"
    kernel: ClassVar = cylindrical
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="point of the axis in the frame of body_i [m]")
    point_j: Vector | None = Field(
        default=None,
        description="point of body_j that stays on the axis, in its frame [m]; default: where point_i starts",
    )

    def rows(self) -> tuple[str, ...]:
        """Distances from the axis along f and g, then the two components of tilt."""
        return ("off_f", "off_g", "tilt_f", "tilt_g")

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        numbers = numbers_at(AXIS, **self.axis_numbers(system))
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("2211"))

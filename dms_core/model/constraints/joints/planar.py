"""Planar joint: a plane of body_j glides on a plane of body_i. Three rows.

(A_i n_i) . d = 0                                           d = r_j + A_j s_j - r_i - A_i s_i   (1)
(A_i f_i) . (A_j n_j) = 0,  (A_i g_i) . (A_j n_j) = 0       f_i, g_i perpendicular to n_i       (2)
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AXIS, AxisJoint
from dms_core.model.constraints.primitives import dot1, dot2, joint_pattern
from dms_core.model.element import Placement, Vector
from dms_core.model.geometry.rotations import cross, vec
from dms_core.model.places import numbers_at


@compiled
def planar(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    f, g, n = vec(par, AXIS.f_i), vec(par, AXIS.g_i), vec(par, AXIS.a_j)
    dot2(0, 0, 7, cross(f, g), vec(par, AXIS.s_i), vec(par, AXIS.s_j), q, v, lam, level, phi, G, W, H)
    dot1(1, 0, 7, f, n, 0.0, q, v, lam, level, phi, G, W, H)
    dot1(2, 0, 7, g, n, 0.0, q, v, lam, level, phi, G, W, H)


class Planar(AxisJoint):
    """Block on a table: body_j glides in the plane through point_i of body_i and turns about its normal.

    What is not given of body_j is taken from the declared start poses.
    """

    kind: ClassVar[str] = "planar"
    kernel: ClassVar = planar
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="point of the plane in the frame of body_i [m]")
    point_j: Vector | None = Field(
        default=None,
        description="point of body_j that stays in the plane, in its frame [m]; default: where point_i starts",
    )
    axis_i: Vector = Field(
        default=(0.0, 0.0, 1.0), description="normal of the plane in the frame of body_i [-]; normalised"
    )
    axis_j: Vector | None = Field(default=None, description="the normal in the frame of body_j [-]; normalised")

    def rows(self) -> tuple[str, ...]:
        """Distance from the plane, then the two components of tilt."""
        return ("off", "tilt_f", "tilt_g")

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        numbers = numbers_at(AXIS, **self.axis_numbers(system))
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("211"))

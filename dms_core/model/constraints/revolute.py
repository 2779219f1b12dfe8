"""Revolute joint: two bodies share a point and an axis. Five rows.

r_i + A_i s_i - r_j - A_j s_j = 0                  (3)
(A_i f_i) . (A_j a_j) = 0,  (A_i g_i) . (A_j a_j) = 0      f_i, g_i perpendicular to a_i   (2)
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.primitives import coincidence, dot1, joint_pattern
from dms_core.model.element import GROUND, Constraint, Placement, Vector
from dms_core.model.geometry.frames import perpendicular, unit
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at


class HingeNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    f_i: int = 6
    """Directions across the axis in the first body."""
    g_i: int = 9
    a_j: int = 12
    """The axis in the second body."""


HINGE = HingeNumbers()


@compiled
def revolute(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    coincidence(0, 0, 7, vec(par, HINGE.s_i), vec(par, HINGE.s_j), q, v, lam, level, phi, G, W, H)
    dot1(3, 0, 7, vec(par, HINGE.f_i), vec(par, HINGE.a_j), 0.0, q, v, lam, level, phi, G, W, H)
    dot1(4, 0, 7, vec(par, HINGE.g_i), vec(par, HINGE.a_j), 0.0, q, v, lam, level, phi, G, W, H)


class Revolute(Constraint):
    """Hinge between body_i and body_j. What is not given of body_j is taken from the declared start poses."""

    kind: ClassVar[str] = "revolute"
    own_points: ClassVar = (HINGE.s_i, HINGE.s_j)
    kernel: ClassVar = revolute
    body_i: str = Field(default=GROUND, description="first body, or 'ground'")
    body_j: str = Field(description="second body")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="joint centre in the frame of body_i [m]")
    point_j: Vector | None = Field(default=None, description="joint centre in the frame of body_j [m]")
    axis_i: Vector = Field(default=(0.0, 0.0, 1.0), description="joint axis in the frame of body_i [-]; normalised")
    axis_j: Vector | None = Field(default=None, description="joint axis in the frame of body_j [-]; normalised")

    def rows(self) -> tuple[str, ...]:
        """Coincidence in ground axes, then the two components of tilt."""
        return ("x", "y", "z", "tilt_f", "tilt_g")

    def aligned(self, numbers) -> tuple[np.ndarray, np.ndarray]:
        """Axis of body_i and that of body_j, which coincide, as rows, shapes (1, 3)."""
        f, g, a = (np.array(numbers[k : k + 3]) for k in (HINGE.f_i, HINGE.g_i, HINGE.a_j))
        return np.cross(f, g)[None], a[None]

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        axis_i = unit(self.axis_i, f"revolute '{self.name}': axis_i")
        axis_j = (
            system.start_direction(self.body_i, axis_i, self.body_j)
            if self.axis_j is None
            else unit(self.axis_j, f"revolute '{self.name}': axis_j")
        )
        point_j = self.point_j
        if point_j is None:
            point_j = system.start_point(self.body_i, self.point_i, self.body_j)
        f = perpendicular(axis_i)
        s_i, s_j = system.arm(self.body_i, self.point_i), system.arm(self.body_j, point_j)
        numbers = numbers_at(HINGE, s_i=s_i, s_j=s_j, f_i=f, g_i=np.cross(axis_i, f), a_j=axis_j)
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("ccc11"))

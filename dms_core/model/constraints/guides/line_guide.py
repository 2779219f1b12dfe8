"""Guide of two rows: a point of body_j stays on a line of body_i, and the bodies turn freely.

    (A_i f) . d = 0,  (A_i g) . d = 0,   d = r_j + A_j s_j - r_i - A_i s_i,  f, g perpendicular to the line

Its multipliers are the forces along f and g [N]: lam (f, g) acts on body_i, -lam (f, g) on body_j.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.relative_pose import joint_arms
from dms_core.model.constraints.primitives import dot2, joint_pattern
from dms_core.model.element import GROUND, Constraint, Placement, Vector
from dms_core.model.geometry.frames import perpendicular, unit
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at


class LineNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    across: int = 6
    """Directions f, g across the line in the first body, six numbers."""


LINE = LineNumbers()


@compiled
def line_guide(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    for k in range(2):
        a, s_i, s_j = vec(par, LINE.across + 3 * k), vec(par, LINE.s_i), vec(par, LINE.s_j)
        dot2(k, 0, 7, a, s_i, s_j, q, v, lam, level, phi, G, W, H)


class LineGuide(Constraint):
    """point_j of body_j stays on the line through point_i of body_i along axis_i."""

    kind: ClassVar[str] = "line_guide"
    own_points: ClassVar = (LINE.s_i, LINE.s_j)
    kernel: ClassVar = line_guide
    body_i: str = Field(default=GROUND, description="body that carries the line, or 'ground'")
    body_j: str = Field(description="body whose point stays on it")
    axis_i: Vector = Field(description="direction of the line in the frame of body_i [-]; normalised")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="point of the line in the frame of body_i [m]")
    point_j: Vector | None = Field(
        default=None, description="guided point in the frame of body_j [m]; default: where point_i starts"
    )

    def rows(self) -> tuple[str, ...]:
        """Distances from the line along f and g [m]."""
        return ("off_f", "off_g")

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        axis = unit(self.axis_i, f"line_guide '{self.name}': axis_i")
        f = perpendicular(axis)
        s_i, s_j = joint_arms(system, self)
        numbers = numbers_at(LINE, s_i=s_i, s_j=s_j, across=[f, np.cross(axis, f)])
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("22"))

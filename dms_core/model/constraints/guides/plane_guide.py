"""Guide of one row: a point of body_j stays in a plane of body_i.

    (A_i n) . (r_j + A_j s_j - r_i - A_i s_i) = 0

The weakest guide that still couples two hinges of one axis: it carries one force along n and lets the point slide
and tilt, so a loop over coincident axes keeps full rank. The stronger guides are `LineGuide` (two rows) and
`Slider` (five rows, the prismatic guide).
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.relative_pose import joint_arms
from dms_core.model.constraints.primitives import dot2, joint_pattern
from dms_core.model.element import GROUND, Constraint, Placement, Vector
from dms_core.model.geometry.frames import unit
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at


class PlaneNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    normal: int = 6
    """In the first body."""


PLANE = PlaneNumbers()


@compiled
def plane_guide(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equation and its derivatives."""
    n, s_i, s_j = vec(par, PLANE.normal), vec(par, PLANE.s_i), vec(par, PLANE.s_j)
    dot2(0, 0, 7, n, s_i, s_j, q, v, lam, level, phi, G, W, H)


class PlaneGuide(Constraint):
    """point_j of body_j stays in the plane through point_i of body_i with the normal normal_i.

    Its multiplier is the force along the normal [N]: lam n acts on body_i, -lam n on body_j.
    """

    kind: ClassVar[str] = "plane_guide"
    own_points: ClassVar = (PLANE.s_i, PLANE.s_j)
    kernel: ClassVar = plane_guide
    body_i: str = Field(default=GROUND, description="body that carries the plane, or 'ground'")
    body_j: str = Field(description="body whose point stays in it")
    normal_i: Vector = Field(description="normal of the plane in the frame of body_i [-]; normalised")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="point of the plane in the frame of body_i [m]")
    point_j: Vector | None = Field(
        default=None, description="guided point in the frame of body_j [m]; default: where point_i starts"
    )

    def rows(self) -> tuple[str, ...]:
        """Distance from the plane [m]."""
        return ("off",)

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        normal = unit(self.normal_i, f"plane_guide '{self.name}': normal_i")
        s_i, s_j = joint_arms(system, self)
        numbers = numbers_at(PLANE, s_i=s_i, s_j=s_j, normal=normal)
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("2"))

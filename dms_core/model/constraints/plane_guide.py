"""Guide of one row: a point of body_j stays in a plane of body_i.

    (A_i n) . (r_j + A_j s_j - r_i - A_i s_i) = 0

The weakest guide that still couples two hinges of one axis: it carries one force along n and lets the point slide
and tilt, so a loop over coincident axes keeps full rank. The stronger guides are `LineGuide` (two rows) and
`Slider` (five rows, the prismatic guide).
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.primitives import dot2, joint_pattern
from dms_core.model.constraints.relative_pose import joint_arms
from dms_core.model.element import GROUND, Constraint, Placement, Vector
from dms_core.model.geometry.frames import unit
from dms_core.model.geometry.rotations import vec


@compiled
def plane_guide(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """par: s_i, s_j, n."""
    dot2(0, 0, 7, vec(par, 6), vec(par, 0), vec(par, 3), q, v, lam, level, phi, G, W, H)


class PlaneGuide(Constraint):
    """point_j of body_j stays in the plane through point_i of body_i with the normal normal_i.

    Its multiplier is the force along the normal [N]: lam n acts on body_i, -lam n on body_j.
    """

    kind: ClassVar[str] = "plane_guide"
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
        numbers = (*joint_arms(system, self), *normal)
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("2"))

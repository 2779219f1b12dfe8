"""A cylinder on a half-space: it touches with the rims of both its ends."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.model.contact.contact import Contact
from dms_core.model.contact.shapes import PLANE_DISC
from dms_core.model.element import Placement, Vector
from dms_core.model.geometry.frames import unit


class CylinderContact(Contact):
    """Contact of a cylinder of body_j with a half-space of body_i, at the deepest point of each end's rim.

    Lying or tilted it touches as a cylinder does. One that stands upright touches with the middle of its end only, and
    falls over: give such a body three points.
    """

    kind: ClassVar[str] = "cylinder_contact"
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="point of the plane in the frame of body_i [m]")
    normal_i: Vector = Field(
        default=(0.0, 1.0, 0.0), description="normal of the plane, out of the half-space, in body_i [-]; normalised"
    )
    centre_j: Vector = Field(default=(0.0, 0.0, 0.0), description="middle of the cylinder in the frame of body_j [m]")
    axis_j: Vector = Field(default=(0.0, 0.0, 1.0), description="its axis in body_j [-]; normalised")
    radius: float = Field(gt=0.0, description="R [m]")
    length: float = Field(gt=0.0, description="length [m]; each end carries its share of the load")

    def placements(self, system) -> tuple[Placement, ...]:
        """One call for each end."""
        who = f"{self.kind} '{self.name}'"
        axis, middle = unit(self.axis_j, f"{who}: axis_j"), system.arm(self.body_j, self.centre_j)
        return tuple(
            self.placed(
                PLANE_DISC,
                s_i=system.arm(self.body_i, self.point_i),
                direction=unit(self.normal_i, f"{who}: normal_i"),
                radius_i=0.0,
                s_j=np.asarray(middle) + half * axis,
                axis=axis,
                radius=self.radius,
            )
            for half in (-0.5 * self.length, 0.5 * self.length)
        )

    def place(self, system) -> Placement:
        """The first end's."""
        return self.placements(system)[0]

"""A sphere, or a point, on a half-space."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.model.contact.contact import Contact
from dms_core.model.contact.shapes import PLANE_SPHERE
from dms_core.model.element import Placement, Vector
from dms_core.model.geometry.frames import unit


class SphereContact(Contact):
    """Contact of a sphere of body_j, or of a point (radius 0), with a half-space of body_i."""

    kind: ClassVar[str] = "sphere_contact"
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="point of the plane in the frame of body_i [m]")
    normal_i: Vector = Field(
        default=(0.0, 1.0, 0.0), description="normal of the plane, out of the half-space, in body_i [-]; normalised"
    )
    centre_j: Vector = Field(default=(0.0, 0.0, 0.0), description="centre in the frame of body_j [m]")
    radius: float = Field(default=0.0, ge=0.0, description="R [m]; 0 is a point")

    def place(self, system) -> Placement:
        """Both bodies."""
        return self.placed(
            PLANE_SPHERE,
            s_i=system.arm(self.body_i, self.point_i),
            direction=unit(self.normal_i, f"{self.kind} '{self.name}': normal_i"),
            radius_i=0.0,
            s_j=system.arm(self.body_j, self.centre_j),
            axis=(0.0, 0.0, 0.0),
            radius=self.radius,
        )

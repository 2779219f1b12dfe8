"""A sphere, or a point, on a cylinder: on its side, its ends, and the rims between them."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.model.contact.contact import Contact
from dms_core.model.contact.shapes import CYLINDER_SPHERE
from dms_core.model.element import Placement, Vector
from dms_core.model.geometry.frames import unit


class SphereCylinderContact(Contact):
    """Contact of a sphere of body_j, or of a point (radius_j 0), with a solid cylinder of body_i.

    The normal is that of the nearest place of the cylinder's surface: across its axis on the side, along it on an end,
    in between on a rim.
    """

    kind: ClassVar[str] = "sphere_cylinder_contact"
    centre_i: Vector = Field(default=(0.0, 0.0, 0.0), description="middle of the cylinder in the frame of body_i [m]")
    axis_i: Vector = Field(default=(0.0, 0.0, 1.0), description="its axis in body_i [-]; normalised")
    radius_i: float = Field(gt=0.0, description="its radius [m]")
    length_i: float = Field(gt=0.0, description="its length [m]")
    centre_j: Vector = Field(default=(0.0, 0.0, 0.0), description="centre of the sphere in the frame of body_j [m]")
    radius_j: float = Field(default=0.0, ge=0.0, description="its radius [m]; 0 is a point")

    def place(self, system) -> Placement:
        """Both bodies."""
        return self.placed(
            CYLINDER_SPHERE,
            s_i=system.arm(self.body_i, self.centre_i),
            direction=unit(self.axis_i, f"{self.kind} '{self.name}': axis_i"),
            radius_i=self.radius_i,
            s_j=system.arm(self.body_j, self.centre_j),
            axis=(0.0, 0.0, 0.0),
            radius=self.radius_j,
            half_length=0.5 * self.length_i,
        )

"""Two cylinders that touch with their sides, crossed or parallel."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.model.contact.contact import Contact
from dms_core.model.contact.shapes import CYLINDERS
from dms_core.model.element import Placement, Vector
from dms_core.model.geometry.frames import unit


class CylinderPairContact(Contact):
    """Contact of the sides of two cylinders, where their axes are nearest; half a sphere closes each end.

    With parallel axes they touch in the middle of the length that both share. A body that tilts there rocks between the
    ends, stiffly and with many small steps; two contacts, one for each half, bring it to rest along the other.

    Axes that cross have no side on which they touch: there, as between spheres with one centre, is no force.
    """

    kind: ClassVar[str] = "cylinder_pair_contact"
    centre_i: Vector = Field(default=(0.0, 0.0, 0.0), description="middle of one cylinder in the frame of body_i [m]")
    axis_i: Vector = Field(default=(0.0, 0.0, 1.0), description="its axis in body_i [-]; normalised")
    radius_i: float = Field(gt=0.0, description="its radius [m]")
    length_i: float = Field(gt=0.0, description="its length, without the half spheres [m]")
    centre_j: Vector = Field(default=(0.0, 0.0, 0.0), description="middle of the other in the frame of body_j [m]")
    axis_j: Vector = Field(default=(0.0, 0.0, 1.0), description="its axis in body_j [-]; normalised")
    radius_j: float = Field(gt=0.0, description="its radius [m]")
    length_j: float = Field(gt=0.0, description="its length, without the half spheres [m]")

    def place(self, system) -> Placement:
        """Both bodies."""
        who = f"{self.kind} '{self.name}'"
        return self.placed(
            CYLINDERS,
            s_i=system.arm(self.body_i, self.centre_i),
            direction=unit(self.axis_i, f"{who}: axis_i"),
            radius_i=self.radius_i,
            s_j=system.arm(self.body_j, self.centre_j),
            axis=unit(self.axis_j, f"{who}: axis_j"),
            radius=self.radius_j,
            half_length=0.5 * self.length_i,
            half_length_j=0.5 * self.length_j,
        )

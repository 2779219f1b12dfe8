"""Two spheres, or a sphere and a point."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import Field, model_validator

from dms_core.model.contact.contact import Contact
from dms_core.model.contact.shapes import SPHERES
from dms_core.model.element import Placement, Vector


class SpherePairContact(Contact):
    """Contact of a sphere of body_i with one of body_j; one of both may be a point (radius 0)."""

    kind: ClassVar[str] = "sphere_pair_contact"
    centre_i: Vector = Field(default=(0.0, 0.0, 0.0), description="centre in the frame of body_i [m]")
    radius_i: float = Field(ge=0.0, description="its radius [m]; 0 is a point")
    centre_j: Vector = Field(default=(0.0, 0.0, 0.0), description="centre in the frame of body_j [m]")
    radius_j: float = Field(ge=0.0, description="its radius [m]; 0 is a point")

    @model_validator(mode="after")
    def _extended(self) -> Self:
        if self.radius_i == self.radius_j == 0.0:
            raise ValueError("radius_i = radius_j = 0: Expected one radius above 0; two points never touch")
        return self

    def place(self, system) -> Placement:
        """Both bodies."""
        return self.placed(
            SPHERES,
            s_i=system.arm(self.body_i, self.centre_i),
            direction=(0.0, 0.0, 0.0),
            radius_i=self.radius_i,
            s_j=system.arm(self.body_j, self.centre_j),
            axis=(0.0, 0.0, 0.0),
            radius=self.radius_j,
        )

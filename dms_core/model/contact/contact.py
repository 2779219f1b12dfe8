"""What all contacts declare: stiffness, restitution, friction."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.model.contact.kernel import contact, contact_by_input
from dms_core.model.contact.law import damping_number
from dms_core.model.contact.shapes import CONTACT
from dms_core.model.element import GROUND, Force, Pattern, Placement
from dms_core.model.places import numbers_at


class Contact(Force):
    """Base of the contacts between two bodies."""

    kernel: ClassVar = contact
    input_kernel: ClassVar = contact_by_input
    body_i: str = Field(default=GROUND, description="first body, or 'ground'")
    body_j: str = Field(description="second body")
    stiffness: float = Field(gt=0.0, description="k [N/m^1.5]")
    restitution: float = Field(
        default=1.0, gt=0.0, le=1.0, description="e, share of its speed that an impact at impact_speed gives back [-]"
    )
    impact_speed: float = Field(default=1.0, gt=0.0, description="speed v at which the restitution is e [m/s]")
    impact_speed_input: str | None = Field(
        default=None, description="name of the input that gives the speed v of each impact [m/s] instead"
    )
    friction: float = Field(default=0.0, ge=0.0, description="coefficient mu [-]")
    slip_speed: float = Field(
        default=1e-3, gt=0.0, description="s, slip at which friction is 71 % of mu N [m/s]; what would stick creeps"
    )

    def input_names(self) -> tuple[str, ...]:
        """The impact's speed, where it is an input."""
        return () if self.impact_speed_input is None else (self.impact_speed_input,)

    def placed(self, shape: int, *, half_length: float = 0.0, half_length_j: float = 0.0, **geometry) -> Placement:
        """The kernel call of a shape.

        Args:
            shape: first integer, see shapes.py.
            half_length: of a cylinder of body i [m].
            half_length_j: of a second cylinder, of body j [m].
            geometry: s_i, direction, radius_i, s_j, axis, radius, see ContactNumbers.
        """
        d = damping_number(self.restitution)
        inputs = self.input_names()
        full, none = np.ones((14, 14), bool), np.zeros((14, 14), bool)
        return Placement(
            bodies=(self.body_i, self.body_j),
            inputs=inputs,
            integers=(shape, len(inputs)),
            numbers=numbers_at(
                CONTACT,
                **geometry,
                stiffness=self.stiffness,
                damping=d if inputs else d / self.impact_speed,
                friction=self.friction,
                slip_speed=self.slip_speed,
                half_length=half_length,
                half_length_j=half_length_j,
            ),
            pattern=Pattern(full, full, none),
        )

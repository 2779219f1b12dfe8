"""Frame without mass: a place on a flexible body to which joints, forces and sensors attach like to a body.

Its seven coordinates have no inertia; `modal_node` determines them all.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.bodies.pose import pose_coordinates
from dms_core.model.element import Body, Coordinate, Pattern, Placement, Quaternion, Vector


@compiled
def interface_frame(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """No mass, no rows."""


class InterfaceFrame(Body):
    """Frame without mass that a constraint holds to a modal body; declared by `modal_body`."""

    kind: ClassVar[str] = "interface_frame"
    kernel: ClassVar = interface_frame
    mass: ClassVar[float] = 0.0
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="at the start [m]")
    orientation: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0), description="Euler parameters at the start, scalar first, of length 1 [-]"
    )
    velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="at the start, ground axes [m/s]")
    euler_rates: Quaternion = Field(
        default=(0.0, 0.0, 0.0, 0.0), description="rates of the Euler parameters at the start [1/s]"
    )

    def coordinates(self) -> tuple[Coordinate, ...]:
        """Position [m] and Euler parameters [-]."""
        return pose_coordinates(self.position, self.orientation, self.velocity, self.euler_rates)

    def place(self, system) -> Placement:
        """Its coordinates."""
        none = np.zeros((7, 7), bool)
        return Placement(bodies=(self.name,), pattern=Pattern(none, none, none))

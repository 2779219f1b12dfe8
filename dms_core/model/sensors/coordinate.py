"""One coordinate as it is, with its rate and acceleration: a PID integral, a fibre length, the state of an equation.

    y = [q_k, v_k, vdot_k]

For a first-order state (Coordinate.differential_rate False) v_k is the state's rate and vdot_k has no meaning.
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Placement, Sensor


@compiled
def coordinate_sensor(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """No numbers."""
    y[0], y[1], y[2] = q[0], v[0], a[0]
    if level > 0:
        Yq[0, 0] = Yv[1, 0] = Ya[2, 0] = 1.0


class CoordinateSensor(Sensor):
    """Value and time derivatives of one generalised coordinate."""

    kind: ClassVar[str] = "coordinate"
    kernel: ClassVar = coordinate_sensor
    coordinate: str = Field(description="'<element>.<coordinate>', for example 'pid.error_integral'")
    unit: str = Field(default="", description="unit of the coordinate, shown with the outputs")

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Value, rate and acceleration."""
        unit = self.unit or "1"
        return (("value", self.unit), ("rate", f"{unit}/s"), ("acceleration", f"{unit}/s^2"))

    def place(self, system) -> Placement:
        """One coordinate."""
        return Placement(coordinates=(self.coordinate,))

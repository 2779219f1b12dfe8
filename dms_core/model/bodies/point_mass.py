"""Point mass (paper sect. 3.1): q = r, three coordinates. Inertia term of M vdot - f_v: m rddot."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Body, Coordinate, Pattern, Placement, Vector


@compiled
def point_mass(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """m rddot; the rows of the constant Euler parameters stay empty."""
    for i in range(3):
        r[i] += par[0] * a[i]
        if level > 0:
            Ja[i, i] += par[0]


@compiled
def point_mass_by_parameter(ip, par, q, v, a, u, Jp):
    """The rows by the mass."""
    for i in range(3):
        Jp[i, 0] = a[i]


class PointMass(Body):
    """A mass without extension. Its axes stay parallel to the ground's: its Euler parameters are constant."""

    kind: ClassVar[str] = "point_mass"
    kernel: ClassVar = point_mass
    parameter_kernel: ClassVar = point_mass_by_parameter
    rigid: ClassVar[bool] = False
    mass: float = Field(gt=0.0, description="mass [kg]")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="at the start, ground axes [m]")
    velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="at the start, ground axes [m/s]")

    def coordinates(self) -> tuple[Coordinate, ...]:
        """Position [m] and velocity [m/s] at the start."""
        return tuple(Coordinate(n, x, xd) for n, x, xd in zip("xyz", self.position, self.velocity, strict=True))

    def place(self, system) -> Placement:
        """One body, its mass."""
        none = np.zeros((7, 7), bool)
        return Placement(
            bodies=(self.name,), numbers=(self.mass,), pattern=Pattern(none, none, np.diag(np.arange(7) < 3))
        )

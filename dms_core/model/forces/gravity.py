"""Gravity (paper sect. 3.1, f_g): the constant force m g at every centre of mass."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.element import Force, Pattern, Placement, Vector


@compiled
def gravity(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """par: m g."""
    for i in range(3):
        r[i] -= par[i]


@compiled
def gravity_by_parameter(ip, par, q, v, a, u, Jp):
    """The rows by m g."""
    for i in range(3):
        Jp[i, i] = -1.0


class Gravity(Force):
    """Weight of all bodies, or of the named ones."""

    kind: ClassVar[str] = "gravity"
    kernel: ClassVar = gravity
    parameter_kernel: ClassVar = gravity_by_parameter
    acceleration: Vector = Field(
        default=(0.0, -9.80665, 0.0), description="in ground axes [m/s^2]; default: standard gravity, y upwards"
    )
    bodies: tuple[str, ...] | None = Field(default=None, description="bodies that have weight; default: all")

    def placements(self, system) -> tuple[Placement, ...]:
        """One call a body."""
        names = tuple(b.name for b in system.bodies) if self.bodies is None else self.bodies
        return tuple(self._weight(system, name) for name in names)

    def _weight(self, system, name: str) -> Placement:
        body = system.body(name)
        if body is None:
            raise ModelError(f"gravity '{self.name}': bodies = {self.bodies}: the ground has no weight; name bodies.")
        none = np.zeros((7, 7), bool)
        weight = tuple(body.mass * g for g in self.acceleration)
        return Placement(bodies=(name,), numbers=weight, pattern=Pattern(none, none, none))

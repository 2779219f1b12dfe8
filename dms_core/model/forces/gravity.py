"""Gravity (paper sect. 3.1, f_g): the constant force m g at every centre of mass.

Where an element has mass with a moment about r of a body (a beam between its nodes, the modes of a flexible body), its
weight has that moment too, see mass_moment.py.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.element import Force, Pattern, Placement, Vector
from dms_core.model.forces.mass_moment import add_moment_load, first_moment, moment_pattern
from dms_core.model.geometry.rotations import AXES, columns, dot, rotated, vec


class GravityNumbers(NamedTuple):
    """Places of the kernel's numbers; all but the first only where mass has a moment."""

    weight: int = 0
    """m g."""
    acceleration: int = 3
    moment: int = 6
    """c_0, then the columns of P."""


GRAVITY = GravityNumbers()


@compiled
def gravity(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: number of the body's further coordinates, -1 where no mass has a moment about r."""
    for i in range(3):
        r[i] -= par[GRAVITY.weight + i]
    if ip[0] >= 0:
        add_moment_load(par, GRAVITY.moment, ip[0], vec(par, GRAVITY.acceleration), q, level, r, Jq)


@compiled
def gravity_by_parameter(ip, par, q, v, a, u, Jp):
    """The rows by m g, g, c_0 and P."""
    for i in range(3):
        Jp[i, GRAVITY.weight + i] = -1.0
    if ip[0] < 0:
        return
    g, c = vec(par, GRAVITY.acceleration), first_moment(par, GRAVITY.moment, ip[0], q)
    d = columns(q, 0, c)
    for i in range(3):
        by_c, along = columns(q, 0, AXES[i]), dot(rotated(q, 0, AXES[i]), g)
        for n in range(4):
            Jp[3 + n, GRAVITY.acceleration + i] = -d[n][i]
            Jp[3 + n, GRAVITY.moment + i] = -dot(by_c[n], g)
        for k in range(ip[0]):
            place = GRAVITY.moment + 3 + 3 * k
            Jp[7 + k, GRAVITY.acceleration + i] = -rotated(q, 0, vec(par, place))[i]
            Jp[7 + k, place + i] = -along
            for n in range(4):
                Jp[3 + n, place + i] = -q[7 + k] * dot(by_c[n], g)


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
        moments = system.mass_moments()
        return tuple(self._weight(system, name, moments.get(name)) for name in names)

    def _weight(self, system, name: str, moment: np.ndarray | None) -> Placement:
        """Weight of one body, with the moment of mass about it, shape (1 + k, 3), if there is one."""
        body = system.body(name)
        if body is None:
            raise ModelError(f"gravity '{self.name}': bodies = {self.bodies}: the ground has no weight; name bodies.")
        weight = tuple(body.mass * g for g in self.acceleration)
        none = np.zeros((7, 7), bool)
        if moment is None:
            return Placement(bodies=(name,), integers=(-1,), numbers=weight, pattern=Pattern(none, none, none))
        further = tuple(f"{name}.{c.name}" for c in body.coordinates()[7:])
        by_q = moment_pattern(len(further))
        return Placement(
            bodies=(name,), coordinates=further, integers=(len(further),),
            numbers=(*weight, *self.acceleration, *map(float, np.ravel(moment))),
            pattern=Pattern(by_q, np.zeros_like(by_q), np.zeros_like(by_q)),
        )  # fmt: skip

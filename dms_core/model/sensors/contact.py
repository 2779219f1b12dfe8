"""Gap, opening speed, normal force and friction of a contact.

    y = [g, n . w, N, mu N |w_t| / sqrt(|w_t|^2 + s^2)]

with the letters of dms_core.model.contact; the gap is negative while the bodies touch, and its zero is an event that a
run can end on (dms_core.simulation.events).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar, Literal

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.contact.contact import Contact
from dms_core.model.contact.kernel import damping_of, input_change, relative_velocity, velocity_changes
from dms_core.model.contact.law import normal_force, slip_of
from dms_core.model.contact.shapes import CONTACT, touch_change, touching
from dms_core.model.element import Placement, Sensor
from dms_core.model.geometry.rotations import across_change, dot


@compiled
def contact_sensor(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """Tables of the contact."""
    damping, mu = damping_of(ip, par, u), par[CONTACT.friction]
    g, n, X = touching(ip[0], par, q)
    w = relative_velocity(q, v, X)
    N, by_depth, by_rate = normal_force(par[CONTACT.stiffness], damping, -g, -dot(n, w))
    slip, size = slip_of(par[CONTACT.slip_speed], n, w)
    speed = math.sqrt(dot(slip, slip))
    share = mu * speed / size
    y[0], y[1], y[2], y[3] = g, dot(n, w), N, share * N
    if level == 0:
        return
    # |w_t| has no slope at 0; there friction is least, and 0 is taken for it.
    by_speed = mu * N * (size * size - speed * speed) / (size * size * size) / speed if speed > 0.0 else 0.0
    for k in range(14):
        dg, dn, dX = touch_change(ip[0], par, q, k)
        by_q, by_v = velocity_changes(q, v, X, dX, k)
        opening = dot(dn, w) + dot(n, by_q)
        dN = -by_depth * dg - by_rate * opening
        Yq[0, k], Yq[1, k], Yq[2, k] = dg, opening, dN
        Yq[3, k] = share * dN + by_speed * dot(slip, across_change(w, n, by_q, dn))
        opening = dot(n, by_v)
        Yv[1, k], Yv[2, k] = opening, -by_rate * opening
        Yv[3, k] = -share * by_rate * opening + by_speed * dot(slip, across_change(w, n, by_v, (0.0, 0.0, 0.0)))
    if ip[1] > 0:
        Yu[2, 0] = input_change(par, u, -g, -dot(n, w))
        Yu[3, 0] = share * Yu[2, 0]


class ContactSensor(Sensor):
    """Gap, its rate, normal force and size of the friction of a contact; the gap is below 0 while it touches."""

    kind: ClassVar[str] = "contact_sensor"
    kernel: ClassVar = contact_sensor
    contact: str = Field(description="name of the contact")
    end: Literal[0, 1] = Field(default=0, description="end of a cylinder: 0 against its axis, 1 along it")

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Gap, opening speed, normal force, friction."""
        return (("gap", "m"), ("rate", "m/s"), ("normal", "N"), ("friction", "N"))

    def place(self, system) -> Placement:
        """The contact's own."""
        placements = system.element(self.contact, Contact).placements(system)
        return replace(placements[min(self.end, len(placements) - 1)], pattern=None)

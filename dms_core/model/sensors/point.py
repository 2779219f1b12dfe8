"""Position, velocity and acceleration of a point of a body, in ground axes (paper sect. 2.4; motion capture).

    y = [r + A s,   rdot + (A s)',   rddot + (A s)'']

With B(x, z) the symmetric bilinear form of dms_core.model.geometry.rotations, A s = B(p, p), (A s)' = 2 B(p, pdot) and
(A s)'' = 2 B(p, pddot) + 2 B(pdot, pdot), so that every partial derivative is a multiple of B(., e_n).
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Placement, Sensor, Vector
from dms_core.model.geometry.rotations import add, columns, point, point_rate, vec
from dms_core.model.sensors.angle import rotated_acceleration


@compiled
def point_acceleration(q, v, a, o, s):
    """Acceleration of a body-fixed point in ground axes [m/s^2]."""
    return add(vec(a, o), rotated_acceleration(q, v, a, o, s))


@compiled
def point_sensor(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """par: s, from the centre of mass."""
    s = vec(par, 0)
    x, x1, x2 = point(q, 0, s), point_rate(q, v, 0, s), point_acceleration(q, v, a, 0, s)
    for m in range(3):
        y[m], y[3 + m], y[6 + m] = x[m], x1[m], x2[m]
    if level > 0:
        # columns(p) is linear in p: of q it is (A s)_p, of v and vdot its time derivatives' parts.
        c, c1, c2 = columns(q, 0, s), columns(v, 0, s), columns(a, 0, s)
        for m in range(3):
            Yq[m, m] = Yv[3 + m, m] = Ya[6 + m, m] = 1.0
            for n in range(4):
                Yq[m, 3 + n] = Yv[3 + m, 3 + n] = Ya[6 + m, 3 + n] = c[n][m]
                Yq[3 + m, 3 + n] = c1[n][m]
                Yv[6 + m, 3 + n] = 2.0 * c1[n][m]
                Yq[6 + m, 3 + n] = c2[n][m]


class Point(Sensor):
    """Motion of a point of a body, seen from the ground."""

    kind: ClassVar[str] = "point"
    kernel: ClassVar = point_sensor
    body: str = Field(description="body, or 'ground'")
    point: Vector = Field(default=(0.0, 0.0, 0.0), description="in the frame of the body [m]")

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Three components of each."""
        quantities = (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2"))
        return tuple((f"{quantity}.{axis}", unit) for quantity, unit in quantities for axis in "xyz")

    def place(self, system) -> Placement:
        """One body; the point relative to its centre of mass."""
        return Placement(bodies=(self.body,), numbers=tuple(system.arm(self.body, self.point)))

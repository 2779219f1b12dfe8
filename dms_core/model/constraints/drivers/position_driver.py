"""Rheonomic constraint on a position: a point of body_j moves along a direction of body_i as an input says. One row.

    (A_i a) . (r_j + A_j s_j - r_i - A_i s_i) - u(t) = 0,   phi_t = -udot,   phi_tt = -uddot

Its multiplier is the drive's force along a [N]: lam a acts on body_i, -lam a on body_j.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.primitives import dot2, joint_pattern
from dms_core.model.element import GROUND, Constraint, Placement, Vector
from dms_core.model.geometry.frames import unit
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at


class DriverNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    axis: int = 6
    """Direction of measurement in the first body."""


DRIVER = DriverNumbers()


@compiled
def position_driver(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equation and its derivatives."""
    axis, s_i, s_j = vec(par, DRIVER.axis), vec(par, DRIVER.s_i), vec(par, DRIVER.s_j)
    dot2(0, 0, 7, axis, s_i, s_j, q, v, lam, level, phi, G, W, H)
    phi[0] -= u[0, 0]
    phi_t[0, 0] = -u[0, 1]
    phi_t[0, 1] = -u[0, 2]


class PositionDriver(Constraint):
    """The component along axis_i of the way from point_i to point_j follows an input [m]."""

    kind: ClassVar[str] = "position_driver"
    own_points: ClassVar = (DRIVER.s_i, DRIVER.s_j)
    kernel: ClassVar = position_driver
    body_i: str = Field(default=GROUND, description="body in which the position is measured, or 'ground'")
    body_j: str = Field(description="driven body")
    axis_i: Vector = Field(description="direction of measurement in the frame of body_i [-]; normalised")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="zero of the measurement in the frame of body_i [m]")
    point_j: Vector = Field(default=(0.0, 0.0, 0.0), description="driven point in the frame of body_j [m]")
    input: str = Field(description="input that gives the position [m]; it must be twice differentiable")

    def rows(self) -> tuple[str, ...]:
        """Position minus input [m]."""
        return ("position",)

    def governs(self) -> str:
        """A point can be driven along a direction once."""
        where = f"from {self.point_i} to {self.point_j}"
        return f"the way of '{self.body_j}' along {self.axis_i} of '{self.body_i}' {where}"

    def place(self, system) -> Placement:
        """Both bodies, the measured direction, the input."""
        axis = unit(self.axis_i, f"position_driver '{self.name}': axis_i")
        s_i, s_j = system.arm(self.body_i, self.point_i), system.arm(self.body_j, self.point_j)
        numbers = numbers_at(DRIVER, s_i=s_i, s_j=s_j, axis=axis)
        return Placement(
            bodies=(self.body_i, self.body_j), inputs=(self.input,), numbers=numbers, pattern=joint_pattern("2")
        )

"""Second-order differential equation with a coordinate of its own: oscillator, filter, actuator.

    m xddot + c xdot + k x - g u = 0

With stiffness and damping 0 it integrates g u twice.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Coordinate, Force, Pattern, Placement


@compiled
def second_order(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: has an input. par: m, c, k, g."""
    r[0] += par[0] * a[0] + par[1] * v[0] + par[2] * q[0]
    if ip[0] == 1:
        r[0] -= par[3] * u[0, 0]
    if level > 0:
        Ja[0, 0] += par[0]
        Jv[0, 0] += par[1]
        Jq[0, 0] += par[2]


@compiled
def second_order_by_input(ip, par, q, v, a, u, Ju):
    """The row by the input: -g."""
    Ju[0, 0, 0] = -par[3]


@compiled
def second_order_by_parameter(ip, par, q, v, a, u, Jp):
    """The row by m, c, k, g."""
    Jp[0, 0], Jp[0, 1], Jp[0, 2] = a[0], v[0], q[0]
    if ip[0] == 1:
        Jp[0, 3] = -u[0, 0]


class SecondOrder(Force):
    """A coordinate x with mass, damping and stiffness, driven by g u. Its coordinate is '<name>.x'."""

    kind: ClassVar[str] = "second_order"
    kernel: ClassVar = second_order
    input_kernel: ClassVar = second_order_by_input
    parameter_kernel: ClassVar = second_order_by_parameter
    mass: float = Field(default=1.0, gt=0.0, description="m [unit of the row per unit of xddot]")
    damping: float = Field(default=0.0, description="c [unit of the row per unit of xdot]")
    stiffness: float = Field(default=0.0, description="k [unit of the row per unit of x]")
    gain: float = Field(default=1.0, description="g [unit of the row per unit of the input]")
    input: str | None = Field(default=None, description="input u; default: u = 0")
    start: float = Field(default=0.0, description="x at the start [unit of x]")
    start_rate: float = Field(default=0.0, description="xdot at the start [unit of x per s]")
    scale: float = Field(default=1.0, gt=0.0, description="nominal size of x, for tolerances [unit of x]")
    rate_scale: float = Field(default=1.0, gt=0.0, description="nominal size of xdot, for tolerances [unit of x per s]")

    def coordinates(self) -> tuple[Coordinate, ...]:
        """The coordinate and its rate."""
        return (Coordinate("x", self.start, self.start_rate, self.scale, self.rate_scale),)

    def input_names(self) -> tuple[str, ...]:
        """The driving input, where there is one."""
        return () if self.input is None else (self.input,)

    def place(self, system) -> Placement:
        """The own coordinate."""
        one = np.ones((1, 1), bool)
        return Placement(
            coordinates=(f"{self.name}.x",),
            inputs=self.input_names(),
            integers=(int(self.input is not None),),
            numbers=(self.mass, self.damping, self.stiffness, self.gain),
            pattern=Pattern(one, one, one),
        )

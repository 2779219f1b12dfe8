"""First-order differential equation with a coordinate of its own: a lag between an input and its effect.

    T xdot + x - g u = 0

The row fixes xdot itself, so that x is a first-order state.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Coordinate, Force, Pattern, Placement


@compiled
def first_order(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: has an input. par: T, g."""
    r[0] += par[0] * v[0] + q[0]
    if ip[0] == 1:
        r[0] -= par[1] * u[0, 0]
    if level > 0:
        Jq[0, 0] += 1.0
        Jv[0, 0] += par[0]


@compiled
def first_order_by_input(ip, par, q, v, a, u, Ju):
    """The row by the input: -g."""
    Ju[0, 0, 0] = -par[1]


@compiled
def first_order_by_parameter(ip, par, q, v, a, u, Jp):
    """The row by T and g."""
    Jp[0, 0] = v[0]
    if ip[0] == 1:
        Jp[0, 1] = -u[0, 0]


class FirstOrder(Force):
    """A state x that follows g u with the time constant T; without input it decays. Its coordinate is '<name>.x'."""

    kind: ClassVar[str] = "first_order"
    kernel: ClassVar = first_order
    input_kernel: ClassVar = first_order_by_input
    parameter_kernel: ClassVar = first_order_by_parameter
    time_constant: float = Field(gt=0.0, description="T [s]")
    gain: float = Field(default=1.0, description="g [unit of x per unit of the input]")
    input: str | None = Field(default=None, description="input u; default: u = 0")
    start: float = Field(default=0.0, description="x at the start [unit of x]")
    scale: float = Field(default=1.0, gt=0.0, description="nominal size of x, for tolerances [unit of x]")

    def coordinates(self) -> tuple[Coordinate, ...]:
        """The state; its rate is fixed by the row itself."""
        rate_scale = self.scale / self.time_constant
        return (Coordinate("x", self.start, scale=self.scale, rate_scale=rate_scale, differential_rate=False),)

    def input_names(self) -> tuple[str, ...]:
        """The followed input, where there is one."""
        return () if self.input is None else (self.input,)

    def place(self, system) -> Placement:
        """The own coordinate."""
        one, none = np.ones((1, 1), bool), np.zeros((1, 1), bool)
        return Placement(
            coordinates=(f"{self.name}.x",),
            inputs=self.input_names(),
            integers=(int(self.input is not None),),
            numbers=(self.time_constant, self.gain),
            pattern=Pattern(one, one, none),
        )

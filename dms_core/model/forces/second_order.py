"""Second-order differential equation with a coordinate of its own: oscillator, filter, actuator.

    m xddot + c xdot + k x - g u = 0

With stiffness and damping 0 it integrates g u twice.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Coordinate, Force, Pattern, Placement
from dms_core.model.places import numbers_at


class SecondOrderNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    mass: int = 0
    damping: int = 1
    stiffness: int = 2
    gain: int = 3


SECOND = SecondOrderNumbers()


@compiled
def second_order(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: has an input."""
    r[0] += par[SECOND.mass] * a[0] + par[SECOND.damping] * v[0] + par[SECOND.stiffness] * q[0]
    if ip[0] == 1:
        r[0] -= par[SECOND.gain] * u[0, 0]
    if level > 0:
        Ja[0, 0] += par[SECOND.mass]
        Jv[0, 0] += par[SECOND.damping]
        Jq[0, 0] += par[SECOND.stiffness]


@compiled
def second_order_by_input(ip, par, q, v, a, u, Ju):
    """The row by the input: -g."""
    Ju[0, 0, 0] = -par[SECOND.gain]


@compiled
def second_order_by_parameter(ip, par, q, v, a, u, Jp):
    """The row by m, c, k, g."""
    Jp[0, SECOND.mass], Jp[0, SECOND.damping], Jp[0, SECOND.stiffness] = a[0], v[0], q[0]
    if ip[0] == 1:
        Jp[0, SECOND.gain] = -u[0, 0]


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
            numbers=numbers_at(SECOND, mass=self.mass, damping=self.damping, stiffness=self.stiffness, gain=self.gain),
            pattern=Pattern(one, one, one),
        )

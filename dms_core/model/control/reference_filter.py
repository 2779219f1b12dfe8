"""Second-order reference filter: turns a setpoint that jumps into a reference that is C1 (paper sect. 3.5).

    vdot_f + 2 zeta w v_f + w^2 (q_f - s(t)) = 0

The controller's row needs psidot, which would be a spike where an input (the action of a learning agent) jumps; the
filter's q_f and v_f are continuous whatever s does. zeta = 1 gives the fastest answer without overshoot.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Coordinate, Force, Pattern, Placement

_ALL = np.ones((1, 1), bool)


@compiled
def reference_filter(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """par: w, zeta."""
    w, zeta = par[0], par[1]
    r[0] = a[0] + 2.0 * zeta * w * v[0] + w * w * (q[0] - u[0, 0])
    if level > 0:
        Jq[0, 0] = w * w
        Jv[0, 0] = 2.0 * zeta * w
        Ja[0, 0] = 1.0


@compiled
def reference_filter_by_input(ip, par, q, v, a, u, Ju):
    """The row by s: -w^2."""
    Ju[0, 0, 0] = -par[0] * par[0]


@compiled
def reference_filter_by_parameter(ip, par, q, v, a, u, Jp):
    """The row by w and zeta."""
    w, zeta = par[0], par[1]
    Jp[0, 0] = 2.0 * zeta * v[0] + 2.0 * w * (q[0] - u[0, 0])
    Jp[0, 1] = 2.0 * w * v[0]


class ReferenceFilter(Force):
    """A smooth setpoint for a controller: owns the coordinate 'setpoint'."""

    kind: ClassVar[str] = "reference_filter"
    kernel: ClassVar = reference_filter
    input_kernel: ClassVar = reference_filter_by_input
    parameter_kernel: ClassVar = reference_filter_by_parameter
    input: str = Field(description="name of the input s(t) that is filtered [unit of the setpoint]")
    frequency: float = Field(gt=0.0, description="natural angular frequency w [rad/s]")
    damping: float = Field(default=1.0, gt=0.0, description="damping ratio zeta [-]")
    start: float | None = Field(
        default=None, description="setpoint at the start [unit of the setpoint]; None means s at the start"
    )

    def coordinates(self) -> tuple[Coordinate, ...]:
        """The filtered setpoint, at rest; its rate changes on the scale of w."""
        return (Coordinate("setpoint", self.start or 0.0, rate_scale=self.frequency),)

    def input_names(self) -> tuple[str, ...]:
        """The raw setpoint."""
        return (self.input,)

    def place(self, system) -> Placement:
        """One coordinate, one input."""
        return Placement(
            coordinates=(f"{self.name}.setpoint",),
            inputs=(self.input,),
            numbers=(self.frequency, self.damping),
            pattern=Pattern(_ALL, _ALL, _ALL),
        )

    def start_states(self, system, q: np.ndarray, u: np.ndarray) -> tuple[tuple[float, float], ...]:
        """Start of each owned coordinate: the given start or the input's value u[0, 0], at rest.

        Args:
            system: the declared system.
            q: local coordinates of the placement at the assembled start, shape (n,).
            u: (value, rate, second derivative) of each local input at the start, shape (k, 3).

        Returns:
            One pair (q, v) [unit of the setpoint, that per second].
        """
        return ((float(u[0, 0]) if self.start is None else self.start, 0.0),)

"""Rope of fixed or prescribed length along a path (paper eq. 11): l(q) - psi = 0. One row.

The force on the bodies is -lam l_q^T: lam is the tension [N]. The equation holds both ways, so a negative tension
means that a real rope would be slack: the result of a run says when and how negative (`Trajectory.flags`). One that is
declared unilateral goes slack instead, and is taken up with an impact (dms_core.simulation.slack).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.element import Constraint, ConstraintPattern, Limit, Placement
from dms_core.model.geometry.path import (
    PathPoint,
    add_path_gradient,
    add_path_hessian,
    add_path_rate_gradient,
    moving_path,
    path_pattern,
    start_length,
)
from dms_core.model.ropes.pushing import no_push


@compiled
def rope_length(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """ip: [length is an input, path]; par: [constant psi, path]."""
    psi = par[0]
    if ip[0] > 0:
        psi = u[0, 0]
        phi_t[0, 0], phi_t[0, 1] = -u[0, 1], -u[0, 2]
    phi[0] = add_path_gradient(ip, 1, par, 1, q, 1.0, G[0]) - psi
    if level > 0:
        add_path_rate_gradient(ip, 1, par, 1, q, v, 1.0, W[0])
        add_path_hessian(ip, 1, par, 1, q, lam[0], H)


class RopeLength(Constraint):
    """Massless, inextensible rope through points of bodies. Without `length` and `input` the start's length is kept."""

    kind: ClassVar[str] = "rope_length"
    kernel: ClassVar = rope_length
    path: tuple[PathPoint, ...] = Field(min_length=2, description="points in the order of the rope")
    length: float | None = Field(
        default=None, gt=0.0, description="length psi [m]; default: that of the declared start poses"
    )
    input: str | None = Field(default=None, description="name of the input that gives the length psi [m] instead")

    unilateral: bool = Field(
        default=False, description="the rope goes slack where its tension would be negative; it is taut at the start"
    )

    @model_validator(mode="after")
    def _one_length(self):
        if self.length is not None and self.input is not None:
            raise ValueError(f"length {self.length} m and input '{self.input}' are both given; give one of them")
        return self

    def rows(self) -> tuple[str, ...]:
        """One."""
        return ("length",)

    def limits(self) -> tuple[Limit, ...]:
        """A rope cannot push; a unilateral one does not."""
        if self.unilateral:
            return ()
        said = "its tension was negative, where a real rope would be slack"
        return no_push("multiplier", f"{self.name}.length", said)

    def place(self, system) -> Placement:
        """Bodies at the ends of the segments that cross from one body to another."""
        table = moving_path(system, f"rope_length '{self.name}'", self.path)
        inputs = () if self.input is None else (self.input,)
        psi = start_length(system, self.path) if self.length is None else self.length
        row = np.ones((1, table.size), bool)
        return Placement(
            bodies=table.bodies,
            inputs=inputs,
            integers=(len(inputs), *table.integers),
            numbers=(psi, *table.numbers),
            pattern=ConstraintPattern(row, row, path_pattern(table, table.size)),
        )

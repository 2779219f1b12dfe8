"""Massless rod: two points of two bodies keep their distance L. One row.

    (d . d - L^2) / (2 L) = 0,   d = r_i + A_i s_i - r_j - A_j s_j

Near the solution this is |d| - L, but smooth everywhere; its multiplier is the tension of the rod [N].
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.element import GROUND, Constraint, ConstraintPattern, Placement, Vector
from dms_core.model.geometry.rotations import dot, vec
from dms_core.model.geometry.separation import (
    add_separation_hessian,
    separation,
    separation_gradient,
    separation_pattern,
    separation_rate_gradient,
)
from dms_core.model.places import numbers_at


class RodNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    length: int = 6


ROD = RodNumbers()


@compiled
def distance(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equation and its derivatives."""
    s_i, s_j, length = vec(par, ROD.s_i), vec(par, ROD.s_j), par[ROD.length]
    d = separation(s_i, s_j, q)
    phi[0] = 0.5 * (dot(d, d) / length - length)
    g = separation_gradient(s_i, s_j, q, d)
    for k in range(14):
        G[0, k] = g[k] / length
    if level > 0:
        w = separation_rate_gradient(s_i, s_j, q, v)
        for k in range(14):
            W[0, k] = w[k] / length
        add_separation_hessian(s_i, s_j, q, lam[0] / length, H)


class Distance(Constraint):
    """Rod without mass between two points, with a ball joint at each end."""

    kind: ClassVar[str] = "distance"
    own_points: ClassVar = (ROD.s_i, ROD.s_j)
    kernel: ClassVar = distance
    body_i: str = Field(default=GROUND, description="first body, or 'ground'")
    body_j: str = Field(description="second body")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="end in the frame of body_i [m]")
    point_j: Vector = Field(default=(0.0, 0.0, 0.0), description="end in the frame of body_j [m]")
    length: float | None = Field(default=None, gt=0.0, description="length [m]; default: that of the start poses")

    def rows(self) -> tuple[str, ...]:
        """Elongation [m]."""
        return ("length",)

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        length = self.length
        if length is None:
            start = system.start_point(self.body_i, self.point_i, self.body_j)
            length = float(np.linalg.norm(start - np.asarray(self.point_j)))
        if length < 1e-9:
            raise ModelError(
                f"distance '{self.name}': the ends start at one point; use a spherical joint for length 0."
            )
        s_i, s_j = system.arm(self.body_i, self.point_i), system.arm(self.body_j, self.point_j)
        row, H = separation_pattern(s_i, s_j)
        pattern = ConstraintPattern(row[None, :], row[None, :], H)
        numbers = numbers_at(ROD, s_i=s_i, s_j=s_j, length=length)
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=pattern)

"""Spring and damper between two points (paper sect. 3.1, f_ext).

    T = k (l - l0) + c ldot + T0,   Q = -T l_q^T,   l = |d|,   d = r_i + A_i s_i - r_j - A_j s_j

With e = d.d / 2:  l_q = e_q / l,  l_qq = (e_qq - l_q^T l_q) / l,  (l_q v)_q = (e_qq v - ldot l_q) / l.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import GROUND, Force, Pattern, Placement, Vector
from dms_core.model.geometry.rotations import dot, scale, vec
from dms_core.model.geometry.separation import (
    add_separation_hessian,
    separation,
    separation_gradient,
    separation_pattern,
    separation_rate,
    separation_rate_gradient,
)
from dms_core.model.places import numbers_at

SHORTEST = 1e-9
"""Length below which the direction is not resolved [m]: the force fades to 0 there instead of a division by 0."""


class SpringNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """End on each body, from its centre of mass [m]."""
    s_j: int = 3
    stiffness: int = 6
    damping: int = 7
    free_length: int = 8
    preload: int = 9


SPRING = SpringNumbers()


@compiled
def spring_damper(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """Row terms T l_q^T."""
    s_i, s_j, k, c = vec(par, SPRING.s_i), vec(par, SPRING.s_j), par[SPRING.stiffness], par[SPRING.damping]
    d = separation(s_i, s_j, q)
    length = max(math.sqrt(dot(d, d)), SHORTEST)
    n = scale(1.0 / length, d)
    rate = dot(n, separation_rate(s_i, s_j, q, v))
    T = k * (length - par[SPRING.free_length]) + c * rate + par[SPRING.preload]
    g = separation_gradient(s_i, s_j, q, n)
    for i in range(14):
        r[i] += T * g[i]
    if level > 0:
        w = separation_rate_gradient(s_i, s_j, q, v)
        add_separation_hessian(s_i, s_j, q, T / length, Jq)
        for i in range(14):
            for j in range(14):
                Jq[i, j] += g[i] * ((k - T / length) * g[j] + c / length * (w[j] - rate * g[j]))
                Jv[i, j] += c * g[i] * g[j]


class SpringDamper(Force):
    """Linear spring and damper in parallel between two points; tension is positive."""

    kind: ClassVar[str] = "spring_damper"
    kernel: ClassVar = spring_damper
    body_i: str = Field(default=GROUND, description="first body, or 'ground'")
    body_j: str = Field(description="second body")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="end in the frame of body_i [m]")
    point_j: Vector = Field(default=(0.0, 0.0, 0.0), description="end in the frame of body_j [m]")
    stiffness: float = Field(default=0.0, ge=0.0, description="k [N/m]")
    damping: float = Field(default=0.0, ge=0.0, description="c [N s/m]")
    free_length: float | None = Field(
        default=None, ge=0.0, description="l0, where the spring is slack [m]; default: length at the start poses"
    )
    preload: float = Field(default=0.0, description="T0, tension at the free length and at rest [N]")

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        length = self.free_length
        if length is None:
            start = system.start_point(self.body_i, self.point_i, self.body_j)
            length = float(np.linalg.norm(start - np.asarray(self.point_j)))
        s_i, s_j = system.arm(self.body_i, self.point_i), system.arm(self.body_j, self.point_j)
        row, _ = separation_pattern(s_i, s_j)
        full, none = np.outer(row, row), np.zeros((14, 14), bool)
        return Placement(
            bodies=(self.body_i, self.body_j),
            numbers=numbers_at(
                SPRING,
                s_i=s_i,
                s_j=s_j,
                stiffness=self.stiffness,
                damping=self.damping,
                free_length=length,
                preload=self.preload,
            ),  # fmt: skip
            pattern=Pattern(full, full if self.damping > 0.0 else none, none),
        )

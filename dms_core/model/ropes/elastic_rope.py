"""Rope that stretches, and is slack where it is shorter than its free length: r = tau l_q^T, tau from stretch.py.

A very stiff one stands for a rope of fixed length that may go slack: a rope of E A = 1e6 N stretches by 0.1 mm a metre
under 100 N. The equation of `rope_length` holds both ways instead.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Force, Pattern, Placement
from dms_core.model.geometry.path import (
    PathPoint,
    add_path_gradient,
    add_path_hessian,
    add_path_rate_gradient,
    behind_path,
    moving_path,
    path_length,
    path_rate,
    start_length,
)
from dms_core.model.ropes.rope_force import PATH_INTEGERS, PATH_NUMBERS
from dms_core.model.ropes.stretch import stretch_tension

STRETCH = 4
"""Source of the tension, see rope_force.py, whose table this is: in place of a constant tension the free length, and
behind the path E A and C."""


@compiled
def elastic_tension(ip, par, q, v):
    """(tau, derivative by l, by the rate)."""
    _, behind = behind_path(ip, PATH_INTEGERS, PATH_NUMBERS)
    length, rate = path_length(ip, PATH_INTEGERS, par, PATH_NUMBERS, q), 0.0
    if par[behind + 1] > 0.0:
        rate = path_rate(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v)
    tau, by_length, _, by_rate = stretch_tension(par[behind], par[behind + 1], length, par[0], rate)
    return tau, by_length, by_rate


@compiled
def elastic_rope(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: [STRETCH, number n of body coordinates, path]; par: [free length, path, E A, C]."""
    n = ip[1]
    tau, by_length, by_rate = elastic_tension(ip, par, q, v)
    if tau <= 0.0:
        return
    add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, 1.0, r)
    if level > 0:
        add_path_hessian(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, tau, Jq)
        # Row 0 of Jv holds (l_q v)_q until it is written itself.
        if by_rate > 0.0:
            add_path_rate_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v, by_rate, Jv[0])
        for i in range(n):
            for j in range(n):
                Jq[i, j] += r[i] * (by_length * r[j] + Jv[0, j])
        for i in range(n):
            for j in range(n):
                Jv[i, j] = by_rate * r[i] * r[j]
    for i in range(n):
        r[i] *= tau


class ElasticRope(Force):
    """Massless elastic rope along a path: it pulls where it is longer than its free length, and never pushes."""

    kind: ClassVar[str] = "elastic_rope"
    kernel: ClassVar = elastic_rope
    path: tuple[PathPoint, ...] = Field(min_length=2, description="points in the order of the rope")
    axial_stiffness: float = Field(gt=0.0, description="E A, tension over strain [N]")
    damping: float = Field(default=0.0, ge=0.0, description="C, tension over rate of strain [N s]; never above E A e")
    free_length: float | None = Field(
        default=None, gt=0.0, description="length x without tension [m]; default: that of the declared start poses"
    )

    def place(self, system) -> Placement:
        """Bodies at the ends of the crossing segments."""
        table = moving_path(system, f"{self.kind} '{self.name}'", self.path)
        full, none = np.ones((table.size, table.size), bool), np.zeros((table.size, table.size), bool)
        free = start_length(system, self.path) if self.free_length is None else self.free_length
        return Placement(
            bodies=table.bodies,
            integers=(STRETCH, table.size, *table.integers),
            numbers=(free, *table.numbers, self.axial_stiffness, self.damping),
            pattern=Pattern(full, full if self.damping > 0.0 else none, none),
        )

"""Rope under a scalar tension (paper eq. 12, 13): f = -tau l_q^T, so that r = -f = tau l_q^T."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.element import Force, Limit, Pattern, Placement
from dms_core.model.geometry.path import PathPoint, add_path_gradient, add_path_hessian, moving_path, path_pattern
from dms_core.model.ropes.pushing import no_push

CONSTANT, INPUT, COORDINATE = 0, 1, 2
"""Where the tension comes from: first integer of the table."""
PATH_INTEGERS, PATH_NUMBERS = 2, 1
"""Indices in `ip` and `par` where the path begins."""


@compiled
def rope_tension(ip, par, q, u):
    """tau [N]. A negative input pulls nothing; a coordinate is taken as it is, its owner keeps it from pushing."""
    if ip[0] == INPUT:
        return max(u[0, 0], 0.0)
    if ip[0] == COORDINATE:
        return q[ip[1]]
    return par[0]


@compiled
def rope_force(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: [source of the tension, number n of body coordinates, path]; par: [constant tension, path]."""
    tau = rope_tension(ip, par, q, u)
    add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, 1.0, r)
    n = ip[1]
    if level > 0:
        add_path_hessian(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, tau, Jq)
        if ip[0] == COORDINATE:
            for k in range(n):
                Jq[k, n] = r[k]
    for k in range(n):
        r[k] *= tau


@compiled
def rope_force_by_input(ip, par, q, v, a, u, Ju):
    """The rows of the bodies by the tension: l_q^T where the input pulls."""
    if u[0, 0] > 0.0:
        add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, 1.0, Ju[:, 0, 0])


class RopeForce(Force):
    """A massless rope that pulls along its path with a tension from one of three sources."""

    kind: ClassVar[str] = "rope_force"
    kernel: ClassVar = rope_force
    input_kernel: ClassVar = rope_force_by_input
    path: tuple[PathPoint, ...] = Field(min_length=2, description="points in the order of the rope")
    tension: float | None = Field(default=None, ge=0.0, description="constant tension [N]")
    input: str | None = Field(
        default=None, description="name of the input that gives the tension [N]; below 0 counts as 0"
    )
    coordinate: str | None = Field(
        default=None, description="coordinate of another element that is the tension [N], as '<element>.<coordinate>'"
    )

    @model_validator(mode="after")
    def _one_source(self):
        given = {k: getattr(self, k) for k in ("tension", "input", "coordinate") if getattr(self, k) is not None}
        if len(given) != 1:
            raise ValueError(f"{given or 'no tension'}; give exactly one of tension, input, coordinate")
        return self

    def input_names(self) -> tuple[str, ...]:
        """The tension, where it is an input."""
        return () if self.input is None else (self.input,)

    def limits(self) -> tuple[Limit, ...]:
        """A rope cannot push: a negative input counts as 0, a coordinate is taken as it is."""
        if self.input is not None:
            said = f"its tension, input '{self.input}', was negative; it pulled nothing, as a rope cannot push"
            return no_push("input", self.input, said)
        if self.coordinate is not None:
            said = f"its tension, coordinate '{self.coordinate}', was negative; it pushed, which no rope can"
            return no_push("coordinate", self.coordinate, said)
        return ()

    def place(self, system) -> Placement:
        """Bodies at the ends of the crossing segments, then the coordinate that is the tension."""
        table = moving_path(system, f"rope_force '{self.name}'", self.path)
        coordinates = () if self.coordinate is None else (self.coordinate,)
        inputs = self.input_names()
        n = table.size + len(coordinates)
        by_q = path_pattern(table, n)
        by_q[: table.size, table.size :] = True
        none = np.zeros((n, n), bool)
        return Placement(
            bodies=table.bodies,
            coordinates=coordinates,
            inputs=inputs,
            integers=(COORDINATE if coordinates else INPUT if inputs else CONSTANT, table.size, *table.integers),
            numbers=(self.tension or 0.0, *table.numbers),
            pattern=Pattern(by_q, none, none),
        )

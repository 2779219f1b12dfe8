"""Lumped load (paper sect. 3.1, f_ext): a force F at a point and a moment M on one body.

With F and M in ground axes, s the point and omega = 2 E(p) pdot the angular velocity in ground axes:

    Q_r = F,   Q_p = (d(A s)/dp)^T F + 2 E(p)^T M,   E^T M = (-e.M, p0 M - e x M)

A load that turns with the body has F = A F_b, and G instead of E: 2 G(p)^T M_b, G^T M_b = (-e.M_b, p0 M_b + e x M_b).
"""

from __future__ import annotations

from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.element import Force, Pattern, Placement, Vector
from dms_core.model.geometry.rotations import add_hessian, columns, cross, dot, euler_parameters, rotated, vec
from dms_core.model.places import numbers_at


class LoadNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    point: int = 0
    """From the centre of mass [m]."""
    force: int = 3
    moment: int = 6


LOAD = LoadNumbers()


@compiled
def _moment(p, m, sign):
    """E^T m for sign -1, G^T m for sign +1: linear in the 4-tuple p."""
    e = (p[1], p[2], p[3])
    x = cross(e, m)
    return (-dot(e, m), p[0] * m[0] + sign * x[0], p[0] * m[1] + sign * x[1], p[0] * m[2] + sign * x[2])


@compiled
def _lumped_load_derivatives(q, s, F, F_b, m, sign, factor, follows, Jq):
    """Jq of -Q."""
    add_hessian(Jq, 0, F, s, -1.0)
    c = columns(q, 0, F_b)
    d = columns(q, 0, s)
    for k in range(4):
        mk = _moment((1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2), 1.0 * (k == 3)), m, sign)
        for n in range(4):
            Jq[3 + n, 3 + k] -= 2.0 * factor * mk[n]
        if follows:
            for i in range(3):
                Jq[i, 3 + k] -= factor * c[k][i]
            for n in range(4):
                Jq[3 + n, 3 + k] -= factor * dot(d[n], c[k])


@compiled
def lumped_load(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: load in body axes, load scaled by the input."""
    follows, factor = ip[0] == 1, 1.0
    if ip[1] == 1:
        factor = u[0, 0]
    s, F_b, m = vec(par, LOAD.point), vec(par, LOAD.force), vec(par, LOAD.moment)
    sign = 1.0 if follows else -1.0
    F = rotated(q, 0, F_b) if follows else F_b
    F = (factor * F[0], factor * F[1], factor * F[2])
    d, x = columns(q, 0, s), _moment(euler_parameters(q, 0), m, sign)
    for i in range(3):
        r[i] -= F[i]
    for n in range(4):
        r[3 + n] -= dot(d[n], F) + 2.0 * factor * x[n]
    if level > 0:
        _lumped_load_derivatives(q, s, F, F_b, m, sign, factor, follows, Jq)


@compiled
def lumped_load_by_input(ip, par, q, v, a, u, Ju):
    """The rows of the body by the factor: the load of factor 1."""
    s, F, m = vec(par, LOAD.point), vec(par, LOAD.force), vec(par, LOAD.moment)
    sign = 1.0 if ip[0] == 1 else -1.0
    if ip[0] == 1:
        F = rotated(q, 0, F)
    d, x = columns(q, 0, s), _moment(euler_parameters(q, 0), m, sign)
    for i in range(3):
        Ju[i, 0, 0] = -F[i]
    for n in range(4):
        Ju[3 + n, 0, 0] = -dot(d[n], F) - 2.0 * x[n]


class LumpedLoad(Force):
    """Force and moment on a body, constant or multiplied by an input."""

    kind: ClassVar[str] = "lumped_load"
    kernel: ClassVar = lumped_load
    input_kernel: ClassVar = lumped_load_by_input
    body: str = Field(description="loaded body")
    point: Vector = Field(default=(0.0, 0.0, 0.0), description="point of attack in the frame of the body [m]")
    force: Vector = Field(default=(0.0, 0.0, 0.0), description="force [N]")
    moment: Vector = Field(default=(0.0, 0.0, 0.0), description="moment [N m]")
    axes: Literal["ground", "body"] = Field(
        default="ground", description="axes of force and moment: fixed, or turning with the body"
    )
    input: str | None = Field(default=None, description="input that multiplies both [-]; default: constant load")

    def input_names(self) -> tuple[str, ...]:
        """The factor, where there is one."""
        return () if self.input is None else (self.input,)

    def place(self, system) -> Placement:
        """One body; point relative to its centre of mass."""
        if system.body(self.body) is None:
            raise ModelError(f"lumped_load '{self.name}': body = 'ground' cannot be loaded; name a body.")
        jq = np.zeros((7, 7), bool)
        jq[3:, 3:] = True
        jq[:3, 3:] = self.axes == "body" and any(self.force)
        none = np.zeros((7, 7), bool)
        return Placement(
            bodies=(self.body,),
            inputs=self.input_names(),
            integers=(int(self.axes == "body"), int(self.input is not None)),
            numbers=numbers_at(LOAD, point=system.arm(self.body, self.point), force=self.force, moment=self.moment),
            pattern=Pattern(jq, none, none),
        )

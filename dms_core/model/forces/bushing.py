"""Bushing: springs and dampers along and about the three axes of a frame, between two bodies.

    y = (d, phi),   d = (A_i a_k) . (r_j + A_j s_j - r_i - A_i s_i),  phi the rotation vector from frame i to frame j
    F_k = curve_k(y_k) + c_k ydot_k,   Q = -sum_k F_k y_k,q^T

Six deflections of six functions of the poses: they are the same wherever both bodies move together, and without
damping the energy of the six curves is that of the bushing, however far it turns. F_4..6 are conjugate to the
components of phi; for small rotations they are the moments about the axes, and for one stiffness about all three they
are at any rotation. The rotation is taken the short way round: beyond half a turn it comes from the other side.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from dms_core.compiled.jit import compiled
from dms_core.errors import DmsError, ModelError
from dms_core.model.constraints.joints.relative_pose import joint_arms
from dms_core.model.constraints.primitives import dot2, dot2_second
from dms_core.model.element import GROUND, Force, Pattern, Placement, Quaternion, Vector
from dms_core.model.forces.load_curve import LoadCurve, curve_load, stiffness_numbers
from dms_core.model.geometry.frames import euler_parameters, rotation_matrix
from dms_core.model.geometry.rotation_vector import (
    add_vector_gradient,
    add_vector_hessian,
    add_vector_rate_gradient,
    rotation_vector,
    short_way,
)
from dms_core.model.geometry.rotations import AXES, point, rotated, sub, vec
from dms_core.model.places import numbers_at
from dms_core.validation import Checked

Six = tuple[float, float, float, float, float, float]


class BushingNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    axes: int = 6
    """Axes of the frame in the first body, nine numbers."""
    c_i: int = 15
    """Euler parameters of both frames in their bodies."""
    c_j: int = 19
    damping: int = 23
    curves: int = 29
    """Six curves behind each other; the integers say where each begins."""


BUSHING = BushingNumbers()
RATES, DEFLECTIONS = 6, 12
"""Rows of the borrowed block behind the six gradients: those of (y_q v)_q, and y and F in one row each."""


@compiled
def _four(par, k):
    """Four numbers from index k, as a tuple."""
    return (par[k], par[k + 1], par[k + 2], par[k + 3])


@compiled
def put_deflections(par, q, v, y, G):
    """y into `y` and y_q into rows 0 to 5 of G, which are zero."""
    s_i, s_j, ci, cj = vec(par, BUSHING.s_i), vec(par, BUSHING.s_j), _four(par, BUSHING.c_i), _four(par, BUSHING.c_j)
    for k in range(3):
        dot2(k, 0, 7, vec(par, BUSHING.axes + 3 * k), s_i, s_j, q, v, y, 0, y, G, G, G)
        add_vector_gradient(3 + k, 0, 7, ci, cj, AXES[k], q, G)
    x, _ = short_way(q, 0, 7, ci, cj)
    phi = rotation_vector(x)
    for k in range(3):
        y[3 + k] = phi[k]


@compiled
def add_second(par, q, v, F, W, H):
    """(y_q v)_q into rows 0 to 5 of W, which are zero, and H += sum_k F_k y_k,qq."""
    s_i, s_j, ci, cj = vec(par, BUSHING.s_i), vec(par, BUSHING.s_j), _four(par, BUSHING.c_i), _four(par, BUSHING.c_j)
    d = sub(point(q, 7, s_j), point(q, 0, s_i))
    for k in range(3):
        axis = vec(par, BUSHING.axes + 3 * k)
        dot2_second(k, 0, 7, axis, s_i, s_j, q, v, F[k], rotated(q, 0, axis), d, W, H)
        add_vector_rate_gradient(3 + k, 0, 7, ci, cj, AXES[k], q, v, W)
    add_vector_hessian(0, 7, ci, cj, (F[3], F[4], F[5]), q, H)


@compiled
def _clear(block):
    """The borrowed block is given back as zero."""
    for i in range(14):
        for j in range(14):
            block[i, j] = 0.0


@compiled
def bushing(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: where each curve begins. Ja, which stays zero, is borrowed for y_q, (y_q v)_q, y and F."""
    _clear(Ja)
    G, W, y, F = Ja, Ja[RATES:], Ja[DEFLECTIONS], Ja[DEFLECTIONS + 1]
    put_deflections(par, q, v, y, G)
    for k in range(6):
        rate = 0.0
        for j in range(14):
            rate += G[k, j] * v[j]
        load, _ = curve_load(par, ip[k], y[k])
        F[k] = load + par[BUSHING.damping + k] * rate
        for j in range(14):
            r[j] += F[k] * G[k, j]
    if level > 0:
        add_second(par, q, v, F, W, Jq)
        for k in range(6):
            _, stiffness = curve_load(par, ip[k], y[k])
            c = par[BUSHING.damping + k]
            for i in range(14):
                for j in range(14):
                    Jq[i, j] += G[k, i] * (stiffness * G[k, j] + c * W[k, j])
                    Jv[i, j] += c * G[k, i] * G[k, j]
    _clear(Ja)


class BushingCurves(Checked):
    """Curves of a bushing in place of its stiffnesses, by component."""

    wrong: ClassVar[type[DmsError]] = ModelError
    x: LoadCurve | None = Field(default=None, description="force [N] against the way along the first axis [m]")
    y: LoadCurve | None = Field(default=None, description="along the second axis")
    z: LoadCurve | None = Field(default=None, description="along the third axis")
    turn_x: LoadCurve | None = Field(default=None, description="moment [N m] against the turn about it [rad]")
    turn_y: LoadCurve | None = Field(default=None, description="about the second axis")
    turn_z: LoadCurve | None = Field(default=None, description="about the third axis")

    def each(self) -> tuple[LoadCurve | None, ...]:
        """The six curves."""
        return self.x, self.y, self.z, self.turn_x, self.turn_y, self.turn_z


class Bushing(Force):
    """Elastic and damped connection of a frame on body_i with one on body_j, along and about three axes.

    What is not given of body_j is taken from the declared start poses, where the bushing then is undeformed.
    """

    kind: ClassVar[str] = "bushing"
    kernel: ClassVar = bushing
    body_i: str = Field(default=GROUND, description="first body, or 'ground'; its frame gives the axes")
    body_j: str = Field(description="second body")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="origin of the frame in body_i [m]")
    point_j: Vector | None = Field(
        default=None, description="origin of the frame in body_j [m]; default: where point_i starts"
    )
    orientation_i: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0),
        description="Euler parameters of the frame in body_i, scalar first [-]",
    )
    orientation_j: Quaternion | None = Field(
        default=None, description="Euler parameters of the frame in body_j [-]; default: along the other at the start"
    )
    stiffness: Six = Field(
        default=(0.0,) * 6, description="along x, y, z of the frame [N/m], then about them [N m/rad]"
    )
    damping: Six = Field(default=(0.0,) * 6, description="along x, y, z [N s/m], then about them [N m s/rad]")
    curves: BushingCurves = Field(default=BushingCurves(), description="curves in place of stiffnesses")

    @field_validator("stiffness", "damping")
    @classmethod
    def _not_negative(cls, value: Six) -> Six:
        for k, x in enumerate(value):
            if x < 0.0:
                raise ValueError(f"component {k} is {x:g}: expected six numbers of at least 0")
        return value

    @field_validator("orientation_i", "orientation_j")
    @classmethod
    def _turned(cls, value: Quaternion | None) -> Quaternion | None:
        if value is not None and np.linalg.norm(value) < 1e-6:
            raise ValueError("Euler parameters have length 0; (1, 0, 0, 0) is no rotation")
        return value

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        curves = self.curves.each()
        for name, stiffness, curve in zip(BushingCurves.model_fields, self.stiffness, curves, strict=True):
            if stiffness > 0.0 and curve is not None:
                raise ValueError(
                    f"component '{name}' has the stiffness {stiffness:g} and a curve; expected one of them"
                )
        if not any((*self.stiffness, *self.damping)) and curves == (None,) * 6:
            raise ValueError("stiffness and damping are 0 and there is no curve; give one of them")
        return self

    def place(self, system) -> Placement:
        """Both bodies; points from their centres of mass."""
        s_i, s_j = joint_arms(system, self)
        frame_i = rotation_matrix(self.orientation_i)
        if self.orientation_j is None:
            frame_j = np.column_stack([system.start_direction(self.body_i, x, self.body_j) for x in frame_i.T])
        else:
            frame_j = rotation_matrix(self.orientation_j)
        integers: list[int] = []
        curves: list[float] = []
        for stiffness, curve in zip(self.stiffness, self.curves.each(), strict=True):
            integers.append(BUSHING.curves + len(curves))
            curves += stiffness_numbers(stiffness) if curve is None else curve.table()
        full, none = np.ones((14, 14), bool), np.zeros((14, 14), bool)
        return Placement(
            bodies=(self.body_i, self.body_j),
            integers=tuple(integers),
            numbers=numbers_at(
                BUSHING,
                s_i=s_i,
                s_j=s_j,
                axes=frame_i.T,
                c_i=euler_parameters(frame_i),
                c_j=euler_parameters(frame_j),
                damping=self.damping,
                curves=curves,
            ),  # fmt: skip
            pattern=Pattern(full, full if any(self.damping) else none, none),
        )

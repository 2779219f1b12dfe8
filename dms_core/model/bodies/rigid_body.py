"""Rigid body in Euler parameters (paper sect. 3.1, eq. 7): q = [r (3), p (4)].

Inertia terms of M vdot - f_v, with omega = 2 G(p) pdot and J about the centre of mass in body axes:

    translation   m rddot
    rotation      4 G^T J G pddot + 8 Gdot^T J G pdot          (Gdot = G(pdot); Haug 1989, 11.1 to 11.3)
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field, field_validator, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.bodies.pose import pose_coordinates
from dms_core.model.element import Body, Coordinate, Pattern, Placement, Quaternion, Vector
from dms_core.model.geometry.frames import euler_rates, rotation_matrix
from dms_core.model.geometry.rotations import euler_parameters


class RigidNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    mass: int = 0
    """[kg]"""
    xx: int = 1
    """Inertia about the centre of mass [kg m^2], and so the next five."""
    yy: int = 2
    zz: int = 3
    xy: int = 4
    xz: int = 5
    yz: int = 6


RIGID = RigidNumbers()


@compiled
def _g_times(p, x):
    """G(p) x for two 4-tuples."""
    return (
        -p[1] * x[0] + p[0] * x[1] + p[3] * x[2] - p[2] * x[3],
        -p[2] * x[0] - p[3] * x[1] + p[0] * x[2] + p[1] * x[3],
        -p[3] * x[0] + p[2] * x[1] - p[1] * x[2] + p[0] * x[3],
    )


@compiled
def _gt_times(p, w):
    """G(p)^T w for a 4-tuple and a 3-tuple."""
    return (
        -p[1] * w[0] - p[2] * w[1] - p[3] * w[2],
        p[0] * w[0] - p[3] * w[1] + p[2] * w[2],
        p[3] * w[0] + p[0] * w[1] - p[1] * w[2],
        -p[2] * w[0] + p[1] * w[1] + p[0] * w[2],
    )


@compiled
def _g_columns(p):
    """The four columns of G(p)."""
    return (-p[1], -p[2], -p[3]), (p[0], -p[3], p[2]), (p[3], p[0], -p[1]), (-p[2], p[1], p[0])


@compiled
def _gt_by_p(w):
    """Derivatives of G(p)^T w by the four components of p."""
    return (0.0, w[0], w[1], w[2]), (-w[0], 0.0, -w[2], w[1]), (-w[1], w[2], 0.0, -w[0]), (-w[2], -w[1], w[0], 0.0)


@compiled
def _inertia_times(par, w):
    """J w."""
    return (
        par[RIGID.xx] * w[0] + par[RIGID.xy] * w[1] + par[RIGID.xz] * w[2],
        par[RIGID.xy] * w[0] + par[RIGID.yy] * w[1] + par[RIGID.yz] * w[2],
        par[RIGID.xz] * w[0] + par[RIGID.yz] * w[1] + par[RIGID.zz] * w[2],
    )


@compiled
def rigid_body(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """M vdot - f_v of one body."""
    m = par[RIGID.mass]
    p, pd, pdd = euler_parameters(q, 0), euler_parameters(v, 0), euler_parameters(a, 0)
    for i in range(3):
        r[i] += m * a[i]
    ga, gv = _inertia_times(par, _g_times(p, pdd)), _inertia_times(par, _g_times(p, pd))
    x, y = _gt_times(p, ga), _gt_times(pd, gv)
    for i in range(4):
        r[3 + i] += 4.0 * x[i] + 8.0 * y[i]
    if level > 0:
        for i in range(3):
            Ja[i, i] += m
        # G is linear: G(e) is its derivative by component k, and G(e) x = -G(x) e.
        gp, gpd, gpdd, ea, ev = _g_columns(p), _g_columns(pd), _g_columns(pdd), _gt_by_p(ga), _gt_by_p(gv)
        for k in range(4):
            turned = _inertia_times(par, gp[k])
            mass, dv2 = _gt_times(p, turned), _gt_times(pd, turned)
            dq2, dq3 = _gt_times(p, _inertia_times(par, gpdd[k])), _gt_times(pd, _inertia_times(par, gpd[k]))
            for i in range(4):
                Ja[3 + i, 3 + k] += 4.0 * mass[i]
                Jq[3 + i, 3 + k] += 4.0 * (ea[k][i] - dq2[i]) - 8.0 * dq3[i]
                Jv[3 + i, 3 + k] += 8.0 * (ev[k][i] + dv2[i])


@compiled(makes_arrays=True)
def rigid_body_by_parameter(ip, par, q, v, a, u, Jp):
    """The rows by mass and inertia, in which they are linear: those of each number 1 with all others 0."""
    for k in range(7):
        one, column, unused = np.zeros(7), np.zeros(7), np.zeros((1, 1))
        one[k] = 1.0
        rigid_body(ip, one, q, v, a, u, 0, column, unused, unused, unused)
        for i in range(7):
            Jp[i, k] = column[i]


class RigidBody(Body):
    """A rigid body. Attachment points elsewhere are given in its reference frame.

    The reference frame has its origin at `position` at the start; the centre of mass, at `centre_of_mass` in that
    frame, is what the coordinates r follow.
    """

    kind: ClassVar[str] = "rigid_body"
    kernel: ClassVar = rigid_body
    parameter_kernel: ClassVar = rigid_body_by_parameter
    mass: float = Field(gt=0.0, description="mass [kg]")
    inertia: tuple[float, ...] = Field(
        description="about the centre of mass, in reference axes [kg m^2]: (xx, yy, zz) or (xx, yy, zz, xy, xz, yz)"
    )
    centre_of_mass: Vector = Field(default=(0.0, 0.0, 0.0), description="in the reference frame [m]")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="origin of the reference frame at the start [m]")
    orientation: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0), description="Euler parameters at the start, scalar first [-]; normalised"
    )
    velocity: Vector = Field(
        default=(0.0, 0.0, 0.0), description="of the reference origin at the start, ground axes [m/s]"
    )
    angular_velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="at the start, ground axes [rad/s]")

    @field_validator("inertia")
    @classmethod
    def _six(cls, value):
        if len(value) not in (3, 6):
            raise ValueError(f"{len(value)} numbers; give 3 (xx, yy, zz) or 6 (xx, yy, zz, xy, xz, yz)")
        return tuple(value) + (0.0,) * (6 - len(value))

    @field_validator("orientation")
    @classmethod
    def _unit(cls, value):
        length = float(np.linalg.norm(value))
        if length < 1e-6:
            raise ValueError("the Euler parameters have length 0; (1, 0, 0, 0) is no rotation")
        return tuple(float(x) / length for x in value)

    @model_validator(mode="after")
    def _possible_inertia(self):
        moments = np.linalg.eigvalsh(self.inertia_matrix())
        if moments[0] <= 0.0:
            raise ValueError(f"inertia {self.inertia}: principal moments {moments} must be positive [kg m^2]")
        if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
            raise ValueError(
                f"inertia {self.inertia}: the principal moments {moments[0]:.6g}, {moments[1]:.6g}, {moments[2]:.6g} "
                "kg m^2 violate the triangle inequality: the largest must not exceed the sum of the other two"
            )
        return self

    def inertia_matrix(self) -> np.ndarray:
        """J about the centre of mass [kg m^2], shape (3, 3)."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def coordinates(self) -> tuple[Coordinate, ...]:
        """Position of the centre of mass [m] and Euler parameters [-], with their rates at the start."""
        A = rotation_matrix(self.orientation)
        lever = A @ np.array(self.centre_of_mass)
        omega = np.array(self.angular_velocity)
        r = np.array(self.position) + lever
        v = np.array(self.velocity) + np.cross(omega, lever)
        return pose_coordinates(r, self.orientation, v, euler_rates(self.orientation, omega))

    def place(self, system) -> Placement:
        """One body, its mass and inertia."""
        block = np.zeros((7, 7), bool)
        block[3:, 3:] = True
        diagonal = block | np.diag([True] * 3 + [False] * 4)
        return Placement(
            bodies=(self.name,), numbers=(self.mass, *self.inertia), pattern=Pattern(block, block, diagonal)
        )

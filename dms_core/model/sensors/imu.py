"""Inertial measurement unit: specific force and angular velocity in body axes (paper sect. 2.4).

    y = [A^T (rddot + (A s)'' - g),   2 G(p) pdot]

An accelerometer at rest shows -g, upwards; in free fall it shows 0 (Titterton and Weston 2004, Strapdown Inertial
Navigation Technology).
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Placement, Sensor, Vector
from dms_core.model.forces.gravity import Gravity
from dms_core.model.geometry.rotations import AXES, add_gradient, dot, euler_parameters, k_times, rotated, sub, vec
from dms_core.model.places import numbers_at
from dms_core.model.sensors.point import point_acceleration


class ImuNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    point: int = 0
    """From the centre of mass [m]."""
    gravity: int = 3
    """In ground axes [m/s^2]."""


IMU = ImuNumbers()


@compiled
def _angular_velocity_rows(p, factor, Y):
    """Y[3:6, 3:7] = 2 factor G(p)."""
    G = (
        (-p[1], p[0], p[3], -p[2]),
        (-p[2], -p[3], p[0], p[1]),
        (-p[3], p[2], -p[1], p[0]),
    )
    for m in range(3):
        for n in range(4):
            Y[3 + m, 3 + n] = 2.0 * factor * G[m][n]


@compiled
def imu(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """Specific force, then angular velocity."""
    s = vec(par, IMU.point)
    p, pd, pdd = euler_parameters(q, 0), euler_parameters(v, 0), euler_parameters(a, 0)
    f = sub(point_acceleration(q, v, a, 0, s), vec(par, IMU.gravity))
    y[3] = 2.0 * (-p[1] * pd[0] + p[0] * pd[1] + p[3] * pd[2] - p[2] * pd[3])
    y[4] = 2.0 * (-p[2] * pd[0] - p[3] * pd[1] + p[0] * pd[2] + p[1] * pd[3])
    y[5] = 2.0 * (-p[3] * pd[0] + p[2] * pd[1] - p[1] * pd[2] + p[0] * pd[3])
    for m in range(3):
        e = rotated(q, 0, AXES[m])
        y[m] = dot(e, f)
        if level > 0:
            by_q, by_v, by_a = k_times(e, s, pdd), k_times(e, s, pd), k_times(e, s, p)
            add_gradient(Yq, m, 0, q, f, AXES[m], 1.0)
            for n in range(4):
                Yq[m, 3 + n] += 2.0 * by_q[n]
                Yv[m, 3 + n] = 4.0 * by_v[n]
                Ya[m, 3 + n] = 2.0 * by_a[n]
            for n in range(3):
                Ya[m, n] = e[n]
    if level > 0:
        # G(p) pdot = -G(pdot) p
        _angular_velocity_rows(pd, -1.0, Yq)
        _angular_velocity_rows(p, 1.0, Yv)


class Imu(Sensor):
    """Accelerometer and gyroscope fixed to a body, along the axes of its reference frame."""

    kind: ClassVar[str] = "imu"
    kernel: ClassVar = imu
    body: str = Field(description="body")
    point: Vector = Field(default=(0.0, 0.0, 0.0), description="place of the sensor in the frame of the body [m]")
    gravity: Vector | None = Field(
        default=None, description="acceleration of gravity, ground axes [m/s^2]; the sum of the system's when not given"
    )

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Specific force, then angular velocity."""
        force = tuple((f"specific_force.{axis}", "m/s^2") for axis in "xyz")
        return force + tuple((f"angular_velocity.{axis}", "rad/s") for axis in "xyz")

    def place(self, system) -> Placement:
        """One body; the point relative to its centre of mass."""
        fields = [force.acceleration for force in system.forces if isinstance(force, Gravity)]
        gravity = self.gravity if self.gravity is not None else np.sum([(0.0, 0.0, 0.0), *fields], axis=0)
        return Placement(
            bodies=(self.body,), numbers=numbers_at(IMU, point=system.arm(self.body, self.point), gravity=gravity)
        )

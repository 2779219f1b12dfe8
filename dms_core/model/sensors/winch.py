"""Tension of a winch's rope, length of its path, and the speed at which the drum winds it."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Placement, Sensor
from dms_core.model.geometry.angle import add_angle_gradient, add_angle_rate_gradient
from dms_core.model.geometry.path import add_path_gradient, add_path_rate_gradient
from dms_core.model.geometry.rotations import vec
from dms_core.model.ropes.winch import PATH_INTEGERS, PATH_NUMBERS, SHORTEST, WINCH, Winch, winch_tension


@compiled
def winch_sensor(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """Tables of the winch."""
    (tau, by_length, by_free, by_rate), length, _, winding = winch_tension(ip, par, q, v)
    y[0], y[1], y[2] = tau, length, winding
    if level > 0:
        f, g, h, R = vec(par, WINCH.f), vec(par, WINCH.g), vec(par, WINCH.h), par[WINCH.radius]
        oi, oj = ip[1], ip[2]
        add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, 1.0, Yq[1])
        add_angle_rate_gradient(2, oi, oj, f, g, h, q, v, R, Yq)
        add_angle_gradient(2, oi, oj, f, g, h, q, R, Yv)
        add_path_rate_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v, by_rate, Yq[0])
        add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, by_rate, Yv[0])
        for j in range(ip[0]):
            Yq[0, j] += by_length * Yq[1, j] + by_rate * Yq[2, j]
            Yv[0, j] += by_rate * Yv[2, j]
        if q[ip[0]] > SHORTEST:
            Yq[0, ip[0]] = by_free


class WinchSensor(Sensor):
    """Tension of a winch's rope, length of its path off the drum, and speed at which the drum winds it."""

    kind: ClassVar[str] = "winch_sensor"
    kernel: ClassVar = winch_sensor
    winch: str = Field(description="name of the winch")

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Tension, length, winding speed."""
        return (("tension", "N"), ("length", "m"), ("winding", "m/s"))

    def place(self, system) -> Placement:
        """The winch's own."""
        return replace(system.element(self.winch, Winch).place(system), pattern=None)

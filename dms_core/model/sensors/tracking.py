"""What a PID controller tracks and how well its integrated error agrees with it (paper sect. 3.5, eq. 21-23).

    y = [e,  v_c - e],   e = psi(t) + q_f - theta(q)

The second is the drift of the error coordinate: e is integrated inside the DAE, not measured.
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.control.pid import FILTER, OWN, PID, Pid
from dms_core.model.element import Placement, Sensor
from dms_core.model.geometry.angle import add_angle_gradient, joint_angle
from dms_core.model.geometry.rotations import vec


@compiled
def tracking(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """ip, par: those of the controller."""
    f, g, h = vec(par, PID.f), vec(par, PID.g), vec(par, PID.h)
    y[0] = -joint_angle(0, 7, f, g, h, q)
    if ip[0] > 0:
        y[0] += u[0, 0]
    if ip[1] > 0:
        y[0] += q[FILTER]
    y[1] = v[OWN] - y[0]
    if level > 0:
        add_angle_gradient(0, 0, 7, f, g, h, q, -1.0, Yq)
        add_angle_gradient(1, 0, 7, f, g, h, q, 1.0, Yq)
        Yv[1, OWN] = 1.0
        if ip[0] > 0:
            Yu[0, 0], Yu[1, 0] = 1.0, -1.0
        if ip[1] > 0:
            Yq[0, FILTER], Yq[1, FILTER] = 1.0, -1.0


class Tracking(Sensor):
    """Error of a PID controller and drift of its error coordinate."""

    kind: ClassVar[str] = "tracking"
    kernel: ClassVar = tracking
    pid: str = Field(description="name of the PID controller")

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Both in radians."""
        return (("error", "rad"), ("drift", "rad"))

    def place(self, system) -> Placement:
        """The controller's own placement, without its pattern, which is that of a row."""
        own = system.element(self.pid, Pid).place(system)
        return Placement(own.bodies, own.coordinates, own.inputs, own.integers, own.numbers)

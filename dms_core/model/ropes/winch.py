"""Winch: a drum that winds an elastic rope.

The rope runs from the drum along a path of length l(q). With the drum's radius R, the joint's angle theta (counted as
winding), and the free length x of what is off the drum, an own coordinate:

    tau from stretch.py with l, x and s = ldot + R thetadot
    r = tau (l_q + R theta_q)^T                      the rope pulls its ends together, and the drum back
    xdot max(l / x, 1) + R thetadot = 0              what is wound has the strain that it has just then

so that at constant tension the rope comes in at R thetadot, and the drum's power is that of the load. What is wound
keeps its strain energy, tau^2 / (2 E A) a metre. The path's first point is where the rope leaves the drum; that it
wanders along and around the drum is left out. The drum may turn any number of times: x is integrated from its rate.
"""

from __future__ import annotations

from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.constraints.joints.revolute import Revolute
from dms_core.model.element import Coordinate, Force, Limit, Pattern, Placement
from dms_core.model.geometry.angle import (
    add_angle_gradient,
    add_angle_hessian,
    add_angle_rate_gradient,
    angle_frame,
    angle_rate,
    half_angle_gradient,
)
from dms_core.model.geometry.path import (
    PathPoint,
    add_path_gradient,
    add_path_hessian,
    add_path_rate_gradient,
    moving_path,
    path_length,
    path_rate,
    start_length,
)
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at
from dms_core.model.ropes.stretch import stretch_tension

SHORTEST = 1e-6
"""Free length [m] below which that is taken for the strain: the winch has no rope left."""


class WinchNumbers(NamedTuple):
    """Places of the kernel's numbers; the path follows."""

    stiffness: int = 0
    damping: int = 1
    radius: int = 2
    """Below 0 where a negative angle winds."""
    f: int = 3
    """Frame of the angle, see dms_core.model.geometry.angle."""
    g: int = 6
    h: int = 9


WINCH = WinchNumbers()
PATH_INTEGERS, PATH_NUMBERS = 3, 12
"""Indices in `ip` and `par` where the path begins."""


@compiled
def winch_tension(ip, par, q, v):
    """(tau, derivatives by l, x and s; l, x, winding speed)."""
    f, g, h = vec(par, WINCH.f), vec(par, WINCH.g), vec(par, WINCH.h)
    length, x = path_length(ip, PATH_INTEGERS, par, PATH_NUMBERS, q), max(q[ip[0]], SHORTEST)
    winding = par[WINCH.radius] * angle_rate(ip[1], ip[2], f, g, h, q, v)
    rate = path_rate(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v) + winding
    found = stretch_tension(par[WINCH.stiffness], par[WINCH.damping], length, x, rate)
    return found, length, x, winding


@compiled
def winch(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: [number n of body coordinates, offsets of the joint's bodies, path]; par: [numbers, path]."""
    f, g, h, R = vec(par, WINCH.f), vec(par, WINCH.g), vec(par, WINCH.h), par[WINCH.radius]
    n, oi, oj = ip[0], ip[1], ip[2]
    (tau, by_length, by_free, by_rate), length, x, winding = winch_tension(ip, par, q, v)
    # s_q = l_q + R theta_q stands in r until the end.
    add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, 1.0, r)
    turn_i, turn_j = half_angle_gradient(oi, oj, f, g, h, q)
    for k in range(4):
        r[oi + 3 + k] += 2.0 * R * turn_i[k]
        r[oj + 3 + k] += 2.0 * R * turn_j[k]
    if level > 0:
        add_angle_gradient(n, oi, oj, f, g, h, q, R, Jv)
        _body_rows(ip, par, q, v, tau, by_length, by_rate, r, Jq, Jv)
        add_angle_rate_gradient(n, oi, oj, f, g, h, q, v, R, Jq)
        taut, left = length > x, q[n] > SHORTEST
        for j in range(n):
            if taut:
                Jq[n, j] += v[n] / x * (r[j] - Jv[n, j])
            if left:
                Jq[j, n] = by_free * r[j]
        if taut and left:
            Jq[n, n] = -v[n] * length / (x * x)
        Jv[n, n] = max(length / x, 1.0)
    for i in range(n):
        r[i] *= tau
    r[n] = v[n] * max(length / x, 1.0) + winding


@compiled
def _body_rows(ip, par, q, v, tau, by_length, by_rate, r, Jq, Jv):
    """Derivatives of the bodies' rows by the bodies, from s_q in r and R theta_q in row n of Jv."""
    f, g, h, R = vec(par, WINCH.f), vec(par, WINCH.g), vec(par, WINCH.h), par[WINCH.radius]
    n, oi, oj = ip[0], ip[1], ip[2]
    if tau <= 0.0:
        return
    # Row n of Jq holds (s_q v)_q for as long as it is needed.
    add_path_rate_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v, by_rate, Jq[n])
    add_angle_rate_gradient(n, oi, oj, f, g, h, q, v, R * by_rate, Jq)
    for i in range(n):
        for j in range(n):
            Jq[i, j] = r[i] * (by_length * (r[j] - Jv[n, j]) + Jq[n, j])
            Jv[i, j] = by_rate * r[i] * r[j]
    for j in range(n):
        Jq[n, j] = 0.0
    add_path_hessian(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, tau, Jq)
    add_angle_hessian(oi, oj, f, g, h, q, R * tau, Jq)


class Winch(Force):
    """A drum on a revolute joint that winds an elastic rope; owns the coordinate 'free_length' [m] of what is off it.

    The joint may be turned by a `dc_motor`. The first point of the path is where the rope leaves the drum, on a body
    that does not turn with it.
    """

    kind: ClassVar[str] = "winch"
    kernel: ClassVar = winch
    path: tuple[PathPoint, ...] = Field(min_length=2, description="points in the order of the rope, from the drum on")
    joint: str = Field(description="revolute joint of the drum, whose body_j is the drum")
    radius: float = Field(gt=0.0, description="R of the drum, to the rope's middle [m]")
    winds: Literal[1, -1] = Field(default=1, description="1 where a growing angle winds the rope, -1 where it unwinds")
    axial_stiffness: float = Field(gt=0.0, description="E A, tension over strain [N]")
    damping: float = Field(default=0.0, ge=0.0, description="C, tension over rate of strain [N s]; never above E A e")
    free_length: float | None = Field(
        default=None, gt=0.0, description="x at the start [m]; default: the path's length at the declared start poses"
    )
    wound: float | None = Field(
        default=None,
        ge=0.0,
        description="rope on the drum at the start [m], behind whose end a drum would wind it backwards; default: any",
    )

    def coordinates(self) -> tuple[Coordinate, ...]:
        """The free length, a first-order state that starts in `start_states`."""
        return (Coordinate("free_length", self.free_length or 0.0, differential_rate=False),)

    def limits(self) -> tuple[Limit, ...]:
        """Between nothing off the drum and nothing on it, where both are known."""
        name, all_off = f"{self.name}.free_length", "all its rope was off the drum, which would wind it backwards"
        high = {} if self.wound is None or self.free_length is None else {"high": self.free_length + self.wound}
        return (Limit("coordinate", name, "m", low=SHORTEST, below="its free rope was used up", above=all_off, **high),)

    def start_states(self, system, q: np.ndarray, u: np.ndarray) -> tuple[tuple[float, float], ...]:
        """The free length at the start, at rest."""
        return ((self.free_length or start_length(system, self.path), 0.0),)

    def place(self, system) -> Placement:
        """Bodies of the path, those of the joint that are none of these, and the free length."""
        who = f"{self.kind} '{self.name}'"
        table = moving_path(system, who, self.path)
        joint = system.element(self.joint, Revolute)
        if self.path[0].body == joint.body_j:
            raise ModelError(
                f"{who}: path.0 is on the drum '{joint.body_j}' itself, around which it would turn. Expected a point "
                f"of a body that does not turn with it, such as '{joint.body_i}'."
            )
        bodies = tuple(dict.fromkeys((*table.bodies, joint.body_i, joint.body_j)))
        n = 7 * len(bodies)
        frame = angle_frame(system, who, joint)
        full, none = np.ones((n + 1, n + 1), bool), np.zeros((n + 1, n + 1), bool)
        by_v = full.copy()
        by_v[:n, n] = False
        return Placement(
            bodies=bodies,
            coordinates=(f"{self.name}.free_length",),
            integers=(n, 7 * bodies.index(joint.body_i), 7 * bodies.index(joint.body_j), *table.integers),
            numbers=(
                *numbers_at(
                    WINCH,
                    stiffness=self.axial_stiffness,
                    damping=self.damping,
                    radius=self.winds * self.radius,
                    f=frame[:3],
                    g=frame[3:6],
                    h=frame[6:],
                ),
                *table.numbers,
            ),
            pattern=Pattern(full, by_v, none),
        )

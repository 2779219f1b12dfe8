"""Error of a joint angle as a nervous system knows it: late. What the paper lacks (sect. 6: proprioceptive feedback).

A pure delay D has no place in a differential-algebraic system; a chain of n equal first-order lags has:

    (D / n) xdot_1 + x_1 - e = 0,   (D / n) xdot_k + x_k - x_(k-1) = 0,   e = psi(t) - theta(q)

Its last state x_n follows e with the mean delay D, and unlike a Pade approximation never starts in the wrong
direction; the spread of the delay is D / sqrt(n), which suits a reflex loop of many fibres (MacDonald 1978, linear
chain trick). Muscles read x_n as '<name>.error'.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Coordinate, Force, Pattern, Placement, Vector
from dms_core.model.geometry.angle import add_angle_gradient, joint_angle
from dms_core.model.geometry.rotations import vec
from dms_core.model.geometry.sensed_angle import sensed_angle
from dms_core.model.places import numbers_at

OWN = 14
"""Local coordinates: two bodies, then the states of the chain from first to last."""


class DelayNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    f: int = 0
    """Frame of the angle, see dms_core.model.geometry.angle."""
    g: int = 3
    h: int = 6
    lag: int = 9
    """Time constant of one lag [s]."""


DELAY = DelayNumbers()


@compiled
def delayed_error(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: number of lags."""
    f, g, h, lag = vec(par, DELAY.f), vec(par, DELAY.g), vec(par, DELAY.h), par[DELAY.lag]
    source = u[0, 0] - joint_angle(0, 7, f, g, h, q)
    for k in range(OWN, OWN + ip[0]):
        r[k] = lag * v[k] + q[k] - source
        source = q[k]
    if level > 0:
        add_angle_gradient(OWN, 0, 7, f, g, h, q, 1.0, Jq)
        for k in range(OWN, OWN + ip[0]):
            Jq[k, k] = 1.0
            Jv[k, k] = lag
            if k > OWN:
                Jq[k, k - 1] = -1.0


@compiled
def delayed_error_by_input(ip, par, q, v, a, u, Ju):
    """The row of the first lag by the reference: -1."""
    Ju[OWN, 0, 0] = -1.0


class DelayedError(Force):
    """Delayed error of a revolute joint's angle against a reference. It exerts no force."""

    kind: ClassVar[str] = "delayed_error"
    kernel: ClassVar = delayed_error
    input_kernel: ClassVar = delayed_error_by_input
    joint: str = Field(description="name of the revolute joint whose angle theta is sensed")
    reference: str = Field(description="name of the input psi(t) [rad]")
    delay: float = Field(gt=0.0, description="mean delay D [s]")
    lags: int = Field(default=3, ge=1, le=8, description="number n of first-order lags in the chain [-]")
    pointer_i: Vector | None = Field(default=None, description="direction of angle 0 in the frame of body_i [-]")
    pointer_j: Vector | None = Field(
        default=None, description="direction in the frame of body_j that lies along pointer_i at angle 0 [-]"
    )

    def coordinates(self) -> tuple[Coordinate, ...]:
        """States of the chain [rad]; the last one, 'error', is what others read."""
        names = [f"stage_{k}" for k in range(1, self.lags)] + ["error"]
        quickest = self.lags / self.delay
        return tuple(Coordinate(n, 0.0, rate_scale=quickest, differential_rate=False) for n in names)

    def input_names(self) -> tuple[str, ...]:
        """The reference."""
        return (self.reference,)

    def place(self, system) -> Placement:
        """Both bodies of the joint, then the chain."""
        who = f"{self.kind} '{self.name}'"
        bodies, frame = sensed_angle(system, who, self.joint, self.pointer_i, self.pointer_j)
        return Placement(
            bodies=bodies,
            coordinates=tuple(f"{self.name}.{c.name}" for c in self.coordinates()),
            inputs=self.input_names(),
            integers=(self.lags,),
            numbers=numbers_at(DELAY, f=frame[:3], g=frame[3:6], h=frame[6:], lag=self.delay / self.lags),
            pattern=_pattern(self.lags),
        )

    def start_states(self, system, q: np.ndarray, u: np.ndarray) -> tuple[tuple[float, float], ...]:
        """Start of the chain: the error of the start, as if it had always been there.

        Args:
            system: the declared system.
            q: local coordinates of the placement at the assembled start, shape (n,).
            u: (value, rate, second derivative) of the reference at the start, shape (1, 3).

        Returns:
            Equal pairs (error [rad], 0), one a lag.
        """
        _, frame = sensed_angle(system, self.name, self.joint, self.pointer_i, self.pointer_j)
        error = float(u[0, 0] - joint_angle(0, 7, frame[0:3], frame[3:6], frame[6:9], q))
        return ((error, 0.0),) * self.lags


def _pattern(lags: int) -> Pattern:
    """The first row knows the Euler parameters of both bodies, each other row its predecessor."""
    n = OWN + lags
    by_q, by_v = np.zeros((n, n), bool), np.zeros((n, n), bool)
    by_q[OWN, 3:7] = by_q[OWN, 10:14] = True
    own = np.arange(OWN, n)
    by_q[own, own] = by_v[own, own] = True
    by_q[own[1:], own[:-1]] = True
    return Pattern(by_q, by_v, np.zeros((n, n), bool))

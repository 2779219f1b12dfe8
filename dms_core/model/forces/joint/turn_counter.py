"""The angle of a joint with its whole turns, which the bodies' poses do not hold: one state x of first order.

    xdot - theta_q v + k e = 0,   e = x - theta brought to -pi .. pi by whole turns

theta is the joint's angle in (-pi, pi], counted from the declared start. The last term draws x to the angle itself, so
that no error of integration gathers: x is off by the error of a step, and the whole turns it tells are exact.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.element import Coordinate, Force, Pattern, Placement
from dms_core.model.geometry.angle import (
    add_angle_gradient,
    add_angle_rate_gradient,
    angle_rate,
    joint_angle,
    start_frame,
)
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at

RETURN = 10.0
"""k [1/s]: ten times faster than a second, in which errors would gather, and slow beside a step."""
NOMINAL_RATE = 10.0
"""Nominal rate of an angle, for tolerances [rad/s]."""


class TurnNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    f: int = 0
    """Frame of the angle, see dms_core.model.geometry.angle."""
    g: int = 3
    h: int = 6


TURN = TurnNumbers()


@compiled
def whole_turns(counted, angle):
    """Multiple of 2 pi that brings an angle nearest to the counted one [rad]."""
    turn = 2.0 * math.pi
    return turn * math.floor((counted - angle) / turn + 0.5)


@compiled
def add_turn_row(k, f, g, h, q, v, level, r, Jq, Jv):
    """Row k, that of the counter itself, for the bodies at 0 and 7; gives the angle with its turns [rad]."""
    angle = joint_angle(0, 7, f, g, h, q)
    angle += whole_turns(q[k], angle)
    r[k] += v[k] - angle_rate(0, 7, f, g, h, q, v) + RETURN * (q[k] - angle)
    if level > 0:
        add_angle_rate_gradient(k, 0, 7, f, g, h, q, v, -1.0, Jq)
        add_angle_gradient(k, 0, 7, f, g, h, q, -RETURN, Jq)
        add_angle_gradient(k, 0, 7, f, g, h, q, -1.0, Jv)
        Jq[k, k] += RETURN
        Jv[k, k] += 1.0
    return angle


@compiled
def turn_counter(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """The row of the counter."""
    add_turn_row(14, vec(par, TURN.f), vec(par, TURN.g), vec(par, TURN.h), q, v, level, r, Jq, Jv)


def counter_pattern() -> np.ndarray:
    """Where derivatives of the counter's row can be non-zero, shape (15, 15)."""
    pattern = np.zeros((15, 15), bool)
    pattern[14] = np.append(np.arange(14) % 7 >= 3, True)
    return pattern


class CountsTurns(Force):
    """Base of what counts the turns of a joint since the declared start, in the coordinate '<name>.angle' [rad]."""

    joint: str = Field(description="joint about an axis")

    def coordinates(self) -> tuple[Coordinate, ...]:
        """The angle, 0 at the declared start; its rate is fixed by the row itself."""
        return (Coordinate("angle", 0.0, rate_scale=NOMINAL_RATE, differential_rate=False),)

    def start_states(self, system, q: np.ndarray, u: np.ndarray) -> tuple[tuple[float, float], ...]:
        """The angle since the declared start at the assembled one.

        Args:
            system: the declared system.
            q: local coordinates of the placement at the assembled start, shape (15,).
            u: no inputs, shape (0, 3).

        Returns:
            One pair (q, v) [rad, rad/s].
        """
        frame = start_frame(system, system.element(self.joint, AxisJoint))
        return ((float(joint_angle(0, 7, tuple(frame[:3]), tuple(frame[3:6]), tuple(frame[6:]), q)), 0.0),)


class TurnCounter(CountsTurns):
    """The turn of a joint since the declared start, whole turns included; its coordinate is '<name>.angle' [rad].

    It exerts nothing. Couplings of several angles bring their own.
    """

    kind: ClassVar[str] = "turn_counter"
    kernel: ClassVar = turn_counter

    def place(self, system) -> Placement:
        """Both bodies of the joint, and the own coordinate."""
        joint = system.element(self.joint, AxisJoint)
        frame = start_frame(system, joint)
        pattern = counter_pattern()
        return Placement(
            bodies=(joint.body_i, joint.body_j),
            coordinates=(f"{self.name}.angle",),
            numbers=numbers_at(TURN, f=frame[:3], g=frame[3:6], h=frame[6:]),
            pattern=Pattern(pattern, pattern, np.zeros((15, 15), bool)),
        )

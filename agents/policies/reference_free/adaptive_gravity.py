"""Adaptive compensation of gravity, for an arm and a load that nobody knows (after Slotine and Li 1987, IJRR 6:49-59).

    M = Y(theta) w + stiffness e,    dw/dt = gain Y^T e - (w - w_0) / memory,    e = theta_r - theta

Y holds the moments of arm and of a kilogram, w their shares. Without a reference of the patient, theta_r is the arm's
own angle behind a low-pass filter: an arm that sinks has too little, one that rises too much. w_0, to which w decays,
is the share of the arm alone, so that a patient who holds the load gets it back.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from exo_env.estimation.reduced_elbow import USUAL_LOAD

from ..tuned import Range
from .assist_moment import SHARE, SMOOTHING, AssistMoment, Seen
from .known import at

MOST_SHARE, HEAVIEST = 3.0, 5.0
"""Largest share of the arm [-] and largest load [kg] that are learned."""


class AdaptiveGravity(AssistMoment):
    """Gravity compensation that learns arm and load.

    Args:
        share: of the arm to which the weights decay [-].
        gain: of learning [1/(Nm s rad)].
        follow: time constant of the angle that the arm is compared with [s].
        stiffness: towards this angle [Nm/rad].
        memory: time constant of forgetting [s].
        damping: against the rate [N m s/rad].
        smoothing: see `AssistMoment`.
    """

    name, title = "adaptive_gravity", "adaptive gravity compensation"
    ranges: ClassVar[dict[str, Range]] = {
        "share": SHARE, "gain": Range(0.01, 10.0, True), "follow": Range(0.05, 2.0, True),
        "stiffness": Range(-5.0, 20.0), "memory": Range(0.3, 30.0, True), "damping": Range(-1.5, 4.0),
        "smoothing": SMOOTHING,
    }  # fmt: skip

    def start(self, observations: np.ndarray, seen: Seen) -> None:
        """The weights begin with what the ropes hold."""
        self._weights = np.array([self.numbers["share"] + self.hanging, USUAL_LOAD * self.hanging])
        self._slow = seen.angle.copy()

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moment of the weights, which learn from the present error."""
        x = self.numbers
        self._slow = self._slow + self.kept(x["follow"]) * (seen.angle - self._slow)
        error = self._slow - seen.angle
        basis = np.array([at(self.known.own, seen.angle), at(self.known.kilogram, seen.angle)])
        rest = np.array([np.broadcast_to(np.asarray(x["share"], float), seen.angle.shape), np.zeros_like(seen.angle)])
        self._weights = self._weights + self.period * x["gain"] * basis * error
        self._weights = self._weights + self.kept(x["memory"]) * (rest - self._weights)
        self._weights = np.clip(self._weights, 0.0, np.array([[MOST_SHARE], [HEAVIEST]]))
        moment = np.sum(basis * self._weights, axis=0)
        return moment + x["stiffness"] * error - x["damping"] * seen.rate

"""Admittance control on the force between forearm and device.

The guide force F tells how the forearm pushes the lower link; with the moment that holds the arm's weight added, the
rest is the patient's will. It moves a virtual joint, which the device follows softly:

    M_h = weight_of_the_arm(theta) - F d,    mass omega' + drag omega = M_h beyond a dead zone,    theta_v' = omega
    M = weight(theta) + stiffness (theta_v - theta) + damping (omega - rate)

with the distance d from the hinge to the guided point.
"""

from __future__ import annotations

from typing import ClassVar

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

from ..batch_policy import one_world
from ..tuned import Range
from .assist_moment import CARRIED, SHARE, SMOOTHING, AssistMoment, Seen

LEASH = 0.4
"""Most by which the virtual joint is ahead of the arm [rad]."""


class Admittance(AssistMoment):
    """Virtual mass and drag that the patient pushes.

    Args:
        mass: virtual inertia [kg m^2].
        drag: virtual damping [N m s/rad].
        dead: moment below which nobody pushes [Nm].
        stiffness: with which the device follows [Nm/rad].
        damping: with which it follows the rate [N m s/rad].
        share: see `AssistMoment`.
        carried: see `AssistMoment`.
        smoothing: see `AssistMoment`.
    """

    name, title = "admittance", "admittance"
    ranges: ClassVar[dict[str, Range]] = {
        "mass": Range(0.02, 2.0, True), "drag": Range(0.3, 30.0, True), "dead": Range(0.0, 2.0),
        "stiffness": Range(0.5, 60.0, True), "damping": Range(0.05, 5.0, True), "share": SHARE, "carried": CARRIED,
        "smoothing": SMOOTHING,
    }  # fmt: skip

    def begin(self, env: gymnasium.Env | VectorEnv, n: int) -> None:
        """Forget the last patients."""
        super().begin(env, n)
        self._distance = one_world(env).ecosystem.device.guide_distance

    def start(self, observations: np.ndarray, seen: Seen) -> None:
        """The virtual joint begins at the arm."""
        self._angle, self._rate = seen.angle.copy(), np.zeros_like(seen.rate)

    def will(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """What the patient gives beyond the weight [Nm], shape (n,)."""
        pushed = self.channels.columns(observations, "device.guide_force")[0] * self._distance
        # The guide gives the arm what the ropes give beyond the link's own weight.
        return self.weight(seen.angle) - self.link(seen.angle) - pushed

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moment that follows the virtual joint."""
        x = self.numbers
        will = self.will(observations, seen)
        will = np.sign(will) * np.maximum(np.abs(will) - x["dead"], 0.0)
        self._rate = (self._rate + self.period * will / x["mass"]) / (1.0 + self.period * x["drag"] / x["mass"])
        ahead = self._angle + self.period * self._rate
        self._angle = np.clip(ahead, seen.angle - LEASH, seen.angle + LEASH)
        follow = x["stiffness"] * (self._angle - seen.angle) + x["damping"] * (self._rate - seen.rate)
        return self.weight(seen.angle) + follow

"""What all policies share that say which moment the device is to give.

Each control period a policy says which moment it wants; that passes a first-order low-pass filter, begins with what
the ropes hold when the episode begins, and becomes the action. No co-tension is asked for: it stiffens the device, and
gives no moment.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

from exo_env.estimation.reduced_elbow import USUAL_LOAD

from ..batch_policy import BatchPolicy, one_world
from ..policy import Channels
from ..tuned import HIDDEN_INTENT, Number, Range
from .known import Known, at

SMOOTHING = Range(0.01, 0.4, True)
DAMPING = Range(-1.5, 4.0)
SHARE = Range(0.0, 1.5)
CARRIED = Range(0.0, 1.2)
MOST_CARRIED = 2.0
"""Largest part of a usual weight that is believed to hang in the ropes [-]."""
LEAST_MOMENT = 0.5
"""Least moment of a usual weight by which a part of it is told [Nm]; the straight arm has none."""


@dataclass(frozen=True)
class Seen:
    """What the device measures in n worlds, shape (n,) each."""

    angle: np.ndarray
    """Of the hinge [rad]."""
    rate: np.ndarray
    """[rad/s]"""
    held: np.ndarray
    """Moment of the ropes by their tensions [Nm]."""


class AssistMoment(BatchPolicy):
    """Base of policies in action mode 'assist_moment'.

    The numbers of most of them are:

    smoothing   time constant of the low-pass filter of the moment [s]
    share       of the moment that holds arm and lower link, which is given all the time [-]
    carried     share of what the ropes hold of the weight beyond that, as they do at the start [-]
    damping     moment against the rate [N m s/rad]; a negative one helps whatever moves, as against friction
    """

    action_mode = "assist_moment"
    tuned_in = HIDDEN_INTENT
    period: float
    """Control period [s]."""
    known: Known
    channels: Channels
    moment: np.ndarray | None
    """The filtered moment [Nm], shape (n,); None until the first observation."""
    hanging: np.ndarray
    """Part of a usual weight that hangs in the ropes, as they tell at the start [-], shape (n,)."""
    _known_env: object = None

    def begin(self, env: gymnasium.Env | VectorEnv, n: int) -> None:
        """Forget the last patients."""
        world = one_world(env)
        if self._known_env is not env:
            self.known, self._known_env = Known(world.ecosystem), env
        self.channels, self.period, self._drive = Channels(env), world.period, world.drive
        self.moment = None

    @abstractmethod
    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moment that the device is to give in each world [Nm], shape (n,)."""

    def start(self, observations: np.ndarray, seen: Seen) -> None:
        """Set what is remembered, from the first observations."""

    def act(self, observations: np.ndarray) -> np.ndarray:
        """The filtered moment, and no co-tension."""
        seen = self._seen(observations)
        if self.moment is None:
            self.moment = seen.held.copy()
            self.hanging = self.part_of(seen)
            self.start(observations, seen)
        self.moment = self.moment + self.kept(self.numbers["smoothing"]) * (
            self.wanted(observations, seen) - self.moment
        )
        return self._drive.action_of(self.moment)

    def kept(self, time_constant: Number) -> Number:
        """Share of a new value that a low-pass filter takes over in a control period [-]."""
        return 1.0 - np.exp(-self.period / np.asarray(time_constant))

    def weight(self, angle: np.ndarray) -> np.ndarray:
        """Moment for the share of arm and lower link, and for what is carried of the weight beyond that [Nm]."""
        given = self.numbers
        return given["share"] * at(self.known.own, angle) + given["carried"] * self.hanging * self.usual(angle)

    def usual(self, angle: np.ndarray) -> np.ndarray:
        """Moment that holds arm, lower link and a usual load [Nm]."""
        return at(self.known.own, angle) + USUAL_LOAD * at(self.known.kilogram, angle)

    def part_of(self, seen: Seen) -> np.ndarray:
        """Part of a usual weight that hangs in the ropes beyond the share of arm and link [-], 0 to MOST_CARRIED."""
        beyond = seen.held - self.numbers.get("share", 0.0) * at(self.known.own, seen.angle)
        return np.clip(beyond / np.maximum(self.usual(seen.angle), LEAST_MOMENT), 0.0, MOST_CARRIED)

    def link(self, angle: np.ndarray) -> np.ndarray:
        """Moment that holds the device's own lower link [Nm]."""
        return at(self.known.link, angle)

    def _seen(self, observations: np.ndarray) -> Seen:
        columns = self.channels.columns
        angle, rate = columns(observations, "device.angle")[0], columns(observations, "device.rate")[0]
        levers, tensions = at(self.known.levers, angle), columns(observations, "device.tension")
        return Seen(angle, rate, np.sum(levers * tensions, axis=0))

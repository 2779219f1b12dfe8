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

from ..batch_policy import BatchPolicy, one_world
from ..policy import Channels
from ..tuned import HIDDEN_INTENT, Number, Range
from .known import Known, at

SMOOTHING = Range(0.01, 0.4, True)
DAMPING = Range(-1.5, 4.0)
SHARE = Range(0.0, 1.5)
CARRIED = Range(0.0, 1.2)
HEAVIEST = 5.0
"""Largest load that is believed [kg]."""
LEAST_LEVER = 0.5
"""Least moment of a kilogram by which a load is estimated [Nm]; nearer to the straight arm the rope has no leverage."""


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
    carried     share of the load's moment, as it is estimated from what the ropes hold at the start [-]
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
    load: np.ndarray
    """Load that is estimated at the start [kg], shape (n,)."""
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
            self.load = self._load_at_start(seen)
            self.start(observations, seen)
        self.moment = self.moment + self.kept(self.numbers["smoothing"]) * (
            self.wanted(observations, seen) - self.moment
        )
        return self._drive.action_of(self.moment)

    def kept(self, time_constant: Number) -> Number:
        """Share of a new value that a low-pass filter takes over in a control period [-]."""
        return 1.0 - np.exp(-self.period / np.asarray(time_constant))

    def weight(self, angle: np.ndarray) -> np.ndarray:
        """Moment for the share of arm and lower link, and for what is carried of the load [Nm]."""
        given = self.numbers
        return given["share"] * at(self.known.own, angle) + given["carried"] * self.load * at(
            self.known.kilogram, angle
        )

    def link(self, angle: np.ndarray) -> np.ndarray:
        """Moment that holds the device's own lower link [Nm]."""
        return at(self.known.link, angle)

    def load_of(self, moment: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Load that has a moment at an angle [kg], from 0 to HEAVIEST."""
        return np.clip(moment / np.maximum(at(self.known.kilogram, angle), LEAST_LEVER), 0.0, HEAVIEST)

    def _load_at_start(self, seen: Seen) -> np.ndarray:
        """Load whose moment, with the share of arm and link, is what the ropes hold at the start [kg]."""
        rest = seen.held - self.numbers.get("share", 1.0) * at(self.known.own, seen.angle)
        return self.load_of(rest, seen.angle)

    def _seen(self, observations: np.ndarray) -> Seen:
        columns = self.channels.columns
        angle, rate = columns(observations, "device.angle")[0], columns(observations, "device.rate")[0]
        levers, tensions = at(self.known.levers, angle), columns(observations, "device.tension")
        return Seen(angle, rate, np.sum(levers * tensions, axis=0))

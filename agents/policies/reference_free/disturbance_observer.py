"""Disturbance observer (Ohnishi 1987; Chen et al. 2000): what muscles and load give is seen from the motion.

    d = LowPass_fast(I rate' + own(theta) - held)        moment of muscles less that of the load
    s = LowPass_slow(d)                                  its lasting part: mostly a load that is not known
    M = share own(theta) - cancel s + gain (d - s) - damping rate

The lasting part is cancelled, as observers do with a disturbance; the changing part is the patient's will, which is
amplified. I is the inertia of an average man's arm with the link; the rate is not differentiated, but filtered.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..tuned import Range
from .assist_moment import DAMPING, SHARE, SMOOTHING, AssistMoment, Seen
from .known import at


class DisturbanceObserver(AssistMoment):
    """Cancels what lasts, amplifies what changes.

    Args:
        share: of the moment of arm and link [-].
        fast: time constant of the observer [s].
        slow: time constant of what lasts [s].
        cancel: share of it that is cancelled [-].
        gain: of what changes [-].
        damping: see `AssistMoment`.
        smoothing: see `AssistMoment`.
    """

    name, title = "disturbance_observer", "disturbance observer"
    ranges: ClassVar[dict[str, Range]] = {
        "share": SHARE, "fast": Range(0.02, 0.4, True), "slow": Range(0.2, 10.0, True), "cancel": Range(0.0, 1.0),
        "gain": Range(-1.0, 3.0), "damping": DAMPING, "smoothing": SMOOTHING,
    }  # fmt: skip

    def start(self, observations: np.ndarray, seen: Seen) -> None:
        """The filters begin at rest."""
        self._rate = seen.rate.copy()
        self._given = at(self.known.own, seen.angle) - seen.held
        self._slow = self._given.copy()

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moment against what lasts, and with what changes."""
        x = self.numbers
        own, kept = at(self.known.own, seen.angle), self.kept(x["fast"])
        # The derivative of the filtered rate.
        acceleration = (seen.rate - self._rate) * kept / self.period
        self._rate = self._rate + kept * (seen.rate - self._rate)
        self._given = self._given + kept * (own - seen.held - self._given)
        found = self.known.inertia * acceleration + self._given
        self._slow = self._slow + self.kept(x["slow"]) * (found - self._slow)
        will = found - self._slow
        return x["share"] * own - x["cancel"] * self._slow + x["gain"] * will - x["damping"] * seen.rate

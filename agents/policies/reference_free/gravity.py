"""Compensation of gravity: what most arm supports do.

    M = share own(theta) + carried part usual(theta) - damping rate

with the moments of an average man's arm with the device's link, and of the same with a usual load (known.py). `Gravity`
has no second part; `GravityLoad` estimates `part` where the arm rests, from what the ropes hold there: what the patient
holds himself is no load of theirs.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..tuned import Range
from .assist_moment import CARRIED, DAMPING, SHARE, SMOOTHING, AssistMoment, Seen
from .known import at


class Gravity(AssistMoment):
    """Compensation of arm and link.

    Args:
        share: see `AssistMoment`; above 1 for an average load.
        damping: see `AssistMoment`.
        smoothing: see `AssistMoment`.
    """

    name, title = "gravity", "gravity compensation"
    ranges: ClassVar[dict[str, Range]] = {"share": Range(0.0, 3.0), "damping": DAMPING, "smoothing": SMOOTHING}

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The share of the moment that holds the arm."""
        return self.numbers["share"] * at(self.known.own, seen.angle) - self.numbers["damping"] * seen.rate


class GravityLoad(AssistMoment):
    """Compensation of arm, link and an estimated load.

    Args:
        share: see `AssistMoment`.
        carried: share of what hangs in the ropes beyond that [-].
        still: rate below which the arm counts as at rest [rad/s].
        memory: time constant of the estimate at rest [s].
        damping: see `AssistMoment`.
        smoothing: see `AssistMoment`.
    """

    name, title = "gravity_load", "gravity compensation with estimated load"
    ranges: ClassVar[dict[str, Range]] = {
        "share": SHARE, "carried": CARRIED, "still": Range(0.02, 1.0, True), "memory": Range(0.1, 5.0, True),
        "damping": DAMPING, "smoothing": SMOOTHING,
    }  # fmt: skip

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moments of arm and estimated load."""
        x = self.numbers
        rests = np.abs(seen.rate) < x["still"]
        self.hanging = self.hanging + rests * self.kept(x["memory"]) * (self.part_of(seen) - self.hanging)
        return self.weight(seen.angle) - x["damping"] * seen.rate

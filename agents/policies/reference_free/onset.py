"""Detector of onsets that completes each movement with minimum jerk (Flash and Hogan 1985).

Where the filtered rate passes a threshold, a movement has begun. It is expected to go on in this direction, by an
amplitude and for a time, as a fifth-order polynomial psi(t); a part `trust` of the amplitude follows the rate that was
seen so far. The device is a soft controller of psi until it is over or the arm turns back; between movements it carries
the weight only.

    M = weight(theta) + stiffness (psi - theta) + damping (psi' - rate)
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..tuned import Range
from .assist_moment import CARRIED, SHARE, SMOOTHING, AssistMoment, Seen

FILTER = 0.04
"""Time constant of the rate's low-pass filter [s]."""
PEAK = 1.875
"""Peak rate of a minimum-jerk movement over its mean rate [-]."""
LARGEST = np.radians(80.0)
"""Largest amplitude that is believed [rad]."""


class Onset(AssistMoment):
    """Onset detector and minimum-jerk completion.

    Args:
        threshold: rate of an onset [rad/s].
        amplitude_deg: expected amplitude [deg].
        duration: expected duration [s].
        trust: part of the amplitude that follows from the rate that was seen [-].
        stiffness: towards the expected movement [Nm/rad].
        damping: towards its rate [N m s/rad].
        share: see `AssistMoment`.
        carried: see `AssistMoment`.
        smoothing: see `AssistMoment`.
    """

    name, title = "onset", "onset detector with minimum-jerk completion"
    ranges: ClassVar[dict[str, Range]] = {
        "threshold": Range(0.05, 1.0, True), "amplitude_deg": Range(5.0, 60.0), "duration": Range(0.5, 2.5),
        "trust": Range(0.0, 1.0), "stiffness": Range(0.3, 60.0, True), "damping": Range(0.05, 5.0, True),
        "share": SHARE, "carried": CARRIED, "smoothing": SMOOTHING,
    }  # fmt: skip

    def start(self, observations: np.ndarray, seen: Seen) -> None:
        """No movement yet."""
        self._rate, self._from = seen.rate.copy(), seen.angle.copy()
        self._time, self._way, self._fastest = (np.zeros_like(seen.angle) for _ in range(3))
        """Time since the onset, its direction (0: no movement), and the largest rate since then."""
        self._ready = np.ones(seen.angle.shape, bool)

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moment towards the expected movement, where there is one."""
        x = self.numbers
        self._rate = self._rate + self.kept(FILTER) * (seen.rate - self._rate)
        self._follow(seen)
        self._fastest = np.maximum(self._fastest, self._rate * self._way)
        supposed = np.radians(x["amplitude_deg"]) + x["trust"] * (
            np.minimum(self._fastest * x["duration"] / PEAK, LARGEST) - np.radians(x["amplitude_deg"])
        )
        s = np.clip(self._time / x["duration"], 0.0, 1.0)
        psi = self._from + self._way * supposed * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        rate = self._way * supposed / x["duration"] * 30.0 * (s * (1.0 - s)) ** 2
        towards = x["stiffness"] * (psi - seen.angle) + x["damping"] * (rate - seen.rate)
        return self.weight(seen.angle) + np.abs(self._way) * towards

    def _follow(self, seen: Seen) -> None:
        """Begin movements, let time pass in them, and end them."""
        x = self.numbers
        self._time = self._time + self.period
        over = (self._way != 0.0) & ((self._time > x["duration"]) | (self._rate * self._way < -x["threshold"]))
        self._way = np.where(over, 0.0, self._way)
        self._ready = np.where(over, False, self._ready | (np.abs(self._rate) < x["threshold"]))
        begins = self._ready & (self._way == 0.0) & (np.abs(self._rate) > x["threshold"])
        self._way = np.where(begins, np.sign(self._rate), self._way)
        self._from, self._time = np.where(begins, seen.angle, self._from), np.where(begins, 0.0, self._time)
        self._fastest = np.where(begins, 0.0, self._fastest)

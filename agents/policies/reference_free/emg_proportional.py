"""Assistance in proportion to the muscles' electromyograms, as in myoelectric orthoses.

    M = gain sum_i c_i(theta) max(e_i - dead, 0) + weight(theta) - damping rate

c_i is the moment of muscle i of an average man at full activation, e_i the envelope of its EMG behind a low-pass
filter. It amplifies what the patient does, and so needs a patient whose muscles still answer.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..tuned import Range
from .assist_moment import CARRIED, DAMPING, SHARE, SMOOTHING, AssistMoment, Seen
from .known import at


class EmgProportional(AssistMoment):
    """Moment in proportion to the EMG.

    Args:
        gain: of the moment over that of an average man with this EMG [-].
        dead: EMG below which a muscle counts as silent [-].
        filtering: time constant of the envelope's low-pass filter [s].
        share: see `AssistMoment`.
        carried: see `AssistMoment`.
        damping: see `AssistMoment`.
        smoothing: see `AssistMoment`.
    """

    name, title = "emg_proportional", "EMG-proportional"
    observation = ("device", "emg")
    ranges: ClassVar[dict[str, Range]] = {
        "gain": Range(0.03, 5.0, True), "dead": Range(0.0, 0.15), "filtering": Range(0.01, 0.5, True), "share": SHARE,
        "carried": CARRIED, "damping": DAMPING, "smoothing": SMOOTHING,
    }  # fmt: skip

    def start(self, observations: np.ndarray, seen: Seen) -> None:
        """The filter begins with the first envelope."""
        self._envelope = self.channels.columns(observations, "emg.emg")

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moment of the EMG, and that of the weight."""
        x = self.numbers
        emg = self.channels.columns(observations, "emg.emg")
        self._envelope = self._envelope + self.kept(x["filtering"]) * (emg - self._envelope)
        muscles = at(self.known.muscles, seen.angle) * np.maximum(self._envelope - x["dead"], 0.0)
        return x["gain"] * muscles.sum(axis=0) + self.weight(seen.angle) - x["damping"] * seen.rate

"""Assistance by the estimated lack of moment: what arm and load need at rest, and muscles do not give.

The filter of the device (exo_env/estimation) tells the moment that all but the device puts on the elbow,
others = muscles - hold, without having to tell muscles from load. At rest the patient lacks

    lack = intended - others

with the part of others that is meant to move the arm, which is no lack. The device carries its own link, and

    M = link(theta) + (1 - gain) share arm(theta) + gain LowPass(lack) + boost intended
        + stiffness (middle - theta) - damping rate

With a gain of 1 the device goes on to hold whatever it holds; with less it lets go, towards a share of an average
arm's weight, and the patient takes over what the patient can. The soft pull to the middle of the exercise is what has
helped most among those that are told no plan (`MeanAngle`).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from exo_env.patient.patient import MIDDLE

from ..tuned import Range
from .assist_moment import DAMPING, SHARE, SMOOTHING, AssistMoment, Seen
from .known import at


class LackAssist(AssistMoment):
    """Moment by the estimated lack.

    Args:
        gain: part of the lack that is given [-].
        filtering: time constant of the lack's low-pass filter [s].
        share: of the arm's moment that is given where nothing is believed of the lack [-].
        boost: moment for each Nm that is intended [-].
        stiffness: towards the middle of the exercise [Nm/rad].
        damping: see `AssistMoment`.
        smoothing: see `AssistMoment`.
    """

    name, title = "lack_assist", "assistance by the estimated lack"
    observation = ("device", "estimated")
    ranges: ClassVar[dict[str, Range]] = {
        "gain": Range(0.0, 1.1), "filtering": Range(0.02, 3.0, True), "share": SHARE, "boost": Range(-1.0, 3.0),
        "stiffness": Range(0.0, 8.0), "damping": DAMPING, "smoothing": SMOOTHING,
    }  # fmt: skip

    def start(self, observations: np.ndarray, seen: Seen) -> None:
        """The filter begins with the first lack."""
        self._lack, _ = self.lack(observations)

    def lack(self, observations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lacking and intended moment in each world [Nm], shape (n,) each."""
        others, intended = (
            self.channels.columns(observations, f"estimated.{name}_moment")[0] for name in ("others", "intended")
        )
        return intended - others, intended

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moment of link, arm, lack and intention."""
        x, (lack, intended) = self.numbers, self.lack(observations)
        self._lack = self._lack + self.kept(x["filtering"]) * (lack - self._lack)
        link = self.link(seen.angle)
        arm = x["share"] * (at(self.known.own, seen.angle) - link)
        carried = arm + x["gain"] * (self._lack - arm)
        pull = x["stiffness"] * (MIDDLE - seen.angle) - x["damping"] * seen.rate
        return link + carried + x["boost"] * intended + pull

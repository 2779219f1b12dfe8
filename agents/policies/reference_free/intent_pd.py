"""A PD on where the patient is estimated to want the arm.

The filter of the device (exo_env/estimation) tells the moment that the patient gives beyond what the patient has
carried lately. It moves a virtual joint, whose angle stands for where the arm is to go, and a soft PD follows:

    mass omega' + drag omega = intended beyond a dead zone,    theta_v' = omega
    M = weight(theta) + stiffness (theta_v - theta) + damping (omega - rate)

`Admittance` moves the same joint by what the cuff feels beyond the weight of an average arm, load and strength left
out. Here, too, the weight of an average arm and a usual load are taken for granted, by `weight` and by the filter; how
far a patient is from them is not known. What lasts of that difference the filter counts to what the patient has carried
lately, so that it does not move the joint for long.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from .admittance import Admittance
from .assist_moment import Seen


class IntentPd(Admittance):
    """Virtual mass and drag that the estimated intention moves; its numbers are those of `Admittance`."""

    name, title = "intent_pd", "PD on the estimated intention"
    observation: ClassVar[tuple[str, ...]] = ("device", "estimated")

    def will(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The estimated intended moment [Nm]."""
        return self.channels.columns(observations, "estimated.intended_moment")[0]

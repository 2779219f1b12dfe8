"""The hand-made oracle: a soft controller of the plan that knows plan, load and ability.

    M = share lacking + stiffness (psi(t + lead) - theta) + damping (psi'(t) - rate)

`lacking` is what the patient lacks of the moment along the plan, with that of the device's own link. No device can know
any of this; the policy says what knowing it would be worth, and tables measure others by it.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..tuned import Range
from .assist_moment import AssistMoment, Seen

AHEAD = np.array([0.0, 0.1, 0.2])
"""Times of the plan that it looks at [s]: now, and the first two of the preview."""


class Oracle(AssistMoment):
    """Controller of the plan.

    Args:
        share: of the moment that the patient lacks [-].
        stiffness: towards the plan [Nm/rad].
        damping: towards its rate [N m s/rad].
        lead: time by which the controller is ahead of the plan [s].
        smoothing: see `AssistMoment`.
    """

    name, title = "oracle", "oracle: PD that knows plan, load and ability"
    observation = ("device", "privileged")
    informed = True
    ranges: ClassVar[dict[str, Range]] = {
        "share": Range(0.0, 1.3), "stiffness": Range(0.3, 100.0, True), "damping": Range(0.05, 10.0, True),
        "lead": Range(0.0, 0.2), "smoothing": Range(0.005, 0.2, True),
    }  # fmt: skip

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """What the patient lacks, and the moment towards the plan."""
        x = self.numbers

        def told(name: str) -> np.ndarray:
            return self.channels.columns(observations, f"privileged.{name}")

        plan = np.array([told("intent")[0], *told("preview")[:2]])
        lead = np.broadcast_to(np.asarray(x["lead"], float), seen.angle.shape)
        psi = np.array([np.interp(t, AHEAD, column) for t, column in zip(lead, plan.T, strict=True)])
        error, rate = psi - told("elbow")[0], told("intent_rate")[0] - told("elbow_rate")[0]
        return x["share"] * told("lacking_moment")[0] + x["stiffness"] * error + x["damping"] * rate

"""The hand-made oracle: a soft PID on the plan that knows plan, load and ability.

    M = share lacking + stiffness e + integral int e dt + damping (psi'(t) - rate),    e = D(psi(t + lead) - theta)

`lacking` is what the patient lacks of the moment along the plan, with that of the device's own link. D is a dead zone,
in which the patient is left alone; the integral, which forgets with a time constant of 2 s, is for patients who do less
than they can. No device can know any of this; the policy says what knowing it would be worth, and tables measure others
by it.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..tuned import Range
from .assist_moment import AssistMoment, Seen

AHEAD = np.array([0.0, 0.1, 0.2])
"""Times of the plan that it looks at [s]: now, and the first two of the preview."""
FORGETTING = 2.0
"""Time constant with which the integral forgets [s]."""


class Oracle(AssistMoment):
    """Controller of the plan.

    Args:
        share: of the moment that the patient lacks [-].
        stiffness: towards the plan [Nm/rad].
        integral: of the error [Nm/(rad s)].
        dead_deg: error that is let be [deg].
        damping: towards its rate [N m s/rad].
        lead: time by which the controller is ahead of the plan [s].
        smoothing: see `AssistMoment`.
    """

    name, title = "oracle", "oracle: PID that knows plan, load and ability"
    observation = ("device", "privileged")
    informed = True
    ranges: ClassVar[dict[str, Range]] = {
        "share": Range(0.0, 1.5), "stiffness": Range(2.0, 200.0, True), "integral": Range(0.3, 200.0, True),
        "dead_deg": Range(0.0, 5.0), "damping": Range(0.2, 10.0, True), "lead": Range(0.0, 0.2),
        "smoothing": Range(0.005, 0.1, True),
    }  # fmt: skip

    def start(self, observations: np.ndarray, seen: Seen) -> None:
        """The integral is empty."""
        self._sum = np.zeros_like(seen.angle)

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """What the patient lacks, and the moment towards the plan."""
        x = self.numbers

        def told(name: str) -> np.ndarray:
            return self.channels.columns(observations, f"privileged.{name}")

        plan = np.array([told("intent")[0], *told("preview")[:2]])
        lead = np.broadcast_to(np.asarray(x["lead"], float), seen.angle.shape)
        psi = np.array([np.interp(t, AHEAD, column) for t, column in zip(lead, plan.T, strict=True)])
        error, rate = psi - told("elbow")[0], told("intent_rate")[0] - told("elbow_rate")[0]
        error = np.sign(error) * np.maximum(np.abs(error) - np.radians(x["dead_deg"]), 0.0)
        self._sum = self._sum + self.period * error - self.kept(FORGETTING) * self._sum
        towards = x["stiffness"] * error + x["integral"] * self._sum + x["damping"] * rate
        return x["share"] * told("lacking_moment")[0] + towards


class SoftOracle(Oracle):
    """The same with numbers of its own, chosen by hand: a teacher for students who cannot see the plan.

    Of a stiff one a student learns to push at all times, and the patient leaves the work to the device.
    """

    name, title = "soft_oracle", "soft oracle: the teacher of students"
    ranges: ClassVar[dict[str, Range]] = {}

    def __init__(self) -> None:
        super().__init__()
        self.numbers = {
            "share": 1.0, "stiffness": 30.0, "integral": 0.0, "dead_deg": 0.0, "damping": 4.0, "lead": 0.1,
            "smoothing": 0.01,
        }  # fmt: skip

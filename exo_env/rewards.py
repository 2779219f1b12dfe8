"""The reward: named terms between about -1 and 1, times weights; each is in `info`, so that none hides in the sum.

    tracking     exp(-(e / 10 deg)^2)
                 1 on the reference. 10 deg is the maximal error of a clinical goniometer at the elbow (Chapleau et al.
                 2011, Clin. Orthop. Relat. Res. 469:3134-3140): what a therapist cannot tell from the reference costs
                 little, and what everybody sees earns nothing.
    assistance   -|M_exo| / 10 Nm, at least -2
                 The device's moment. People after stroke let a robot do the work (Wolbrecht et al. 2008, IEEE TNSRE
                 16:286-297), so help is to be given no more than is needed. 10 Nm is about twice what 1 kg and the
                 forearm need; assumed.
    smoothness   -mean((a - a_before)^2) / 4
                 -1 for an action that jumps from end to end; assumed.
    reaction     -max(F / 500 N - 1, 0), at least -2
                 Elbow reaction above that of quiet lifting, which pulling against oneself causes; assumed.
    unsafe       -1 once, where an event ends the episode, see events.py

With the default weights a second of good tracking is worth 50, a second of 10 Nm of help costs 25, and an unsafe event
100: two seconds of tracking beside what is lost by the end of the episode. The weights are assumed.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from exo_env.settings import Settings

TRACKING_WIDTH = math.radians(10.0)
"""Error that earns 1/e [rad]."""
LARGE_MOMENT, REACTION_THRESHOLD, MOST = 10.0, 500.0, 2.0
"""[Nm], [N], and the largest cost of assistance and reaction [-]."""


class Weights(Settings):
    """Factor on each term."""

    tracking: float = Field(default=1.0, ge=0.0, le=1e6)
    assistance: float = Field(default=0.5, ge=0.0, le=1e6)
    smoothness: float = Field(default=0.2, ge=0.0, le=1e6)
    reaction: float = Field(default=0.2, ge=0.0, le=1e6)
    unsafe: float = Field(default=100.0, ge=0.0, le=1e6)


def terms(
    *, error: float, moment: float, reaction: float, action: np.ndarray, before: np.ndarray, unsafe: bool
) -> dict[str, float]:
    """Value of each term [-].

    Args:
        error: elbow angle minus reference [rad].
        moment: of the exoskeleton [Nm].
        reaction: size of the elbow's reaction force [N].
        action: now, shape (2,).
        before: the action before, shape (2,).
        unsafe: an event ends the episode.
    """
    return {
        "tracking": math.exp(-((error / TRACKING_WIDTH) ** 2)),
        "assistance": -min(abs(moment) / LARGE_MOMENT, MOST),
        "smoothness": -0.25 * float(np.mean((action - before) ** 2)),
        "reaction": -min(max(reaction / REACTION_THRESHOLD - 1.0, 0.0), MOST),
        "unsafe": -1.0 if unsafe else 0.0,
    }


def total(values: dict[str, float], weights: Weights) -> float:
    """The reward."""
    return float(sum(getattr(weights, name) * x for name, x in values.items()))

"""The reward: named terms between about -1 and 1, times weights; each is in `info`, so that none hides in the sum.

    tracking     exp(-(e / 5 deg)^2)
                 1 on the reference. One reading of the elbow by a goniometer spreads by 2.4 to 3.4 deg (Fish and
                 Wingate 1985, Phys. Ther. 65:1666-1670), so 95 % of readings lie within 4.7 to 6.7 deg: what a
                 therapist cannot tell from the reference costs little, and what everybody sees earns nothing.
    assistance   -max(M_exo - M_lack, -M_exo, 0) / mean M_need, at least -2
                 The device's moment beyond what this patient lacks (patient/ability.py): 0 for help that is needed,
                 about -1 where the device does all for somebody who needs nothing, and less where it pulls down.
                 People after stroke let a robot do the work (Wolbrecht et al. 2008, IEEE TNSRE 16:286-297), and
                 slacking is what training by robots loses most by (Reinkensmeyer et al. 2009,
                 doi:10.1109/IEMBS.2009.5333978): the patient is to do what the patient can. Who can do nothing is
                 helped for nothing.
    smoothness   -mean((a - a_before)^2) / 4
                 -1 for an action that jumps from end to end; assumed.
    reaction     -max(F / 500 N - 1, 0), at least -2
                 Elbow reaction above that of quiet lifting, which pulling against oneself causes; assumed.
    unsafe       -1 once, where an event ends the episode, see limits.py

The most that a step can earn is 1, a followed reference without a newton too much: 300 in an episode of 6 s. With the
default weights a robot that does everything for somebody who needs nothing still earns a quarter of that, more than an
arm that hangs; half of such help costs as much as a constant error of 3.4 deg, the spread of a therapist's reading. An
unsafe event costs as much as two seconds of the best, beside what is lost by the end of the episode. The weights are
assumed.
"""

from __future__ import annotations

import math

from pydantic import Field

from dms_core.compiled.jit import compiled
from exo_env.places import places
from exo_env.settings import Settings

TRACKING_WIDTH = math.radians(5.0)
"""Error from a shown reference that earns 1/e [rad]."""
REACTION_THRESHOLD, MOST = 500.0, 2.0
"""Reaction above which it costs [N], and the largest cost of assistance and reaction [-]."""


class Weights(Settings):
    """Weight of each reward term."""

    tracking: float = Field(default=1.0, ge=0.0, le=1e6)
    assistance: float = Field(default=0.75, ge=0.0, le=1e6)
    smoothness: float = Field(default=0.2, ge=0.0, le=1e6)
    reaction: float = Field(default=0.2, ge=0.0, le=1e6)
    unsafe: float = Field(default=100.0, ge=0.0, le=1e6)


TERM = places(Weights.model_fields)
"""Place of each term in the order of the weights."""


@compiled
def term_values(error, width, moment, lacking, scale, reaction, action, before, unsafe, out):
    """Value of each term [-], at the places of TERM.

    Args:
        error: elbow angle minus reference [rad].
        width: error that earns 1/e [rad].
        moment: moment of the exoskeleton, flexion positive [Nm].
        lacking: what the patient cannot give, at least 0 [Nm].
        scale: mean moment that the movement needs [Nm].
        reaction: size of the elbow's reaction force [N].
        action: the present action, shape (n,).
        before: the action before, shape (n,).
        unsafe: whether an event ends the episode.
        out: the values, filled, shape (len(TERM),).
    """
    change = 0.0
    for i in range(action.shape[0]):
        change += (action[i] - before[i]) ** 2
    out[TERM.tracking] = math.exp(-((error / width) ** 2))
    out[TERM.assistance] = -min(max(moment - lacking, -moment, 0.0) / scale, MOST)
    out[TERM.smoothness] = -0.25 * change / action.shape[0]
    out[TERM.reaction] = -min(max(reaction / REACTION_THRESHOLD - 1.0, 0.0), MOST)
    out[TERM.unsafe] = -1.0 if unsafe else 0.0

"""The reward of assistance without a reference: the terms of rewards.py about the patient's plan, and one more.

    tracking     exp(-(e / 10 deg)^2), e how far the arm is from where the patient wants it, psi
                 Nobody but the patient knows psi, and the width is assumed, about as large as errors of position
                 sense: the upper limit of the mean error of people without impairment who put the forearm back where
                 it was is 10.7 deg, and 17 of 18 people after stroke stayed below it (Gurari, Drogos and Dewald 2018,
                 PLoS ONE 13:e0206518). Half of the help of a device that does all for somebody who needs nothing
                 costs as much as an error of 6.9 deg.
    assistance   help beyond what this patient lacks; as in rewards.py
    smoothness, reaction, unsafe      as in rewards.py
    opposition   -min(P / (mean M_need 1 rad/s), 2),  P = max(M_exo - max(M_need, 0), 0) max(-psi', 0)
                                                          + max(-M_exo, 0) max(psi', 0)
                 The device's power against the move that the patient wants: it pushes up more than arm and load
                 weigh while the patient wants down, or pulls down while the patient wants up. To carry the weight
                 while it is lowered is no opposition.

Who guesses wrong costs the patient work; one that helps nobody harms nobody. As in rewards.py a step earns at most 1,
450 in an episode of 9 s. The weight of opposition is assumed: a device that holds its own weight's worth against a move
of 1 rad/s loses half of what a followed plan earns.
"""

from __future__ import annotations

import math

from pydantic import Field

from dms_core.compiled.jit import compiled
from exo_env.places import places
from exo_env.tasks.judgement.rewards import MOST, Weights

INTENT_WIDTH = math.radians(10.0)
"""Error from the patient's plan that earns 1/e [rad]."""
USUAL_RATE = 1.0
"""Rate of a usual move [rad/s]."""


class IntentWeights(Weights):
    """Weight of each reward term."""

    opposition: float = Field(default=0.5, ge=0.0, le=1e6)


INTENT_TERM = places(IntentWeights.model_fields)
"""Place of each term in the order of the weights; the first are those of rewards.py."""


@compiled
def opposing_power(moment, needed, rate):
    """The device's power against the move that the patient wants [W].

    Args:
        moment: moment of the exoskeleton, flexion positive [Nm].
        needed: moment that arm and load need along the plan [Nm].
        rate: of the plan [rad/s].
    """
    if rate < 0.0:
        return max(moment - max(needed, 0.0), 0.0) * -rate
    return max(-moment, 0.0) * rate


@compiled
def opposition(power, scale):
    """Value of the term [-] of a power [W]; `scale` is the mean moment that the movement needs [Nm]."""
    return -min(power / (scale * USUAL_RATE), MOST)

"""Slacking: effort is forgotten all the time, and every error recruits it.

Emken et al. (2007, J. Neurophysiol. 97:3997-4006) derive and fit, for the effort u and the error x of one movement
after another,

    u_{i+1} = f u_i + g x_i,   f < 1

as the greedy minimum of error and effort: there is no error too small to count, and forgetting never pauses. Smith,
Rowe and Reinkensmeyer (2018, J. Neurophysiol., doi:10.1152/jn.00700.2017) find the same within a movement: while the
shown error is held at zero, force decays exponentially from 0.25 s on, at a rate in proportion to the force, "until
visual error prompts correction". So with a rate, for the effort s as a multiple of what was planned:

    s' = -rate (s - s_0) + recovery e,   0 <= s <= 2

e = psi - theta is the error by which the arm hangs back; one that is ahead lowers the effort. rate = -ln(f) / T and
recovery = g / T for movements of duration T. Effort s rests where e = rate (s - s_0) / recovery: a patient alone hangs
back by that much, and a device that leaves no error leaves no effort above s_0. That forgetting ends at s_0, and that
effort ends at twice the plan, is assumed.
"""

from __future__ import annotations

import math

from dms_core.compiled.jit import compiled

MOST_EFFORT = 2.0
"""Largest multiple of what was planned [-]."""


@compiled
def advance_effort(effort, error, rate, recovery, least, duration):
    """Effort s after a time [s] under a constant error [rad]; exact within the limits."""
    if rate > 0.0:
        rest = least + recovery * error / rate
        after = rest + (effort - rest) * math.exp(-rate * duration)
    else:
        after = effort + recovery * error * duration
    return min(max(after, 0.0), MOST_EFFORT)

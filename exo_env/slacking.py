"""Slacking: a patient does less when the device does the work and nothing is lost by it.

Emken et al. (2007, J. Neurophysiol. 97:3997-4006) found effort from one movement to the next to be f u + g e with a
forgetting factor f < 1; Reinkensmeyer, Wolbrecht and Bobrow (2007, doi:10.1109/IEMBS.2007.4353215) and Wolbrecht et
al. (2008, IEEE TNSRE 16:286-297) found the same of people after stroke in a robot that lifts their arm. Here
with a rate, for the effort s as a share of the command:

    s' = -A (s - s_0) + B (1 - s)
    A = rate w(e) share,   w = 1 for e <= 0, 1 - e / tolerance below the tolerance, 0 beyond
    B = recovery max(e - tolerance, 0)

e = psi - theta is the error by which the arm hangs back; `share` what the device carries of the work. Published
forgetting is on at all times; that it is in proportion to the device's share is assumed, so that a patient without a
device does what was planned. The tolerance is assumed too, after the error weighting of the robot of Emken, Benitez
and Reinkensmeyer (2007, J. NeuroEng. Rehabil. 4:8), which disregards natural variability.
"""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def advance_effort(effort, error, share, rate, tolerance, recovery, least, duration):
    """Effort s after a time [s] under a constant error [rad] and share of the device [-]; exact."""
    small = min(max(1.0 - error / tolerance, 0.0), 1.0)
    forgetting = rate * small * min(max(share, 0.0), 1.0)
    returning = recovery * max(error - tolerance, 0.0)
    speed = forgetting + returning
    if speed <= 0.0:
        return effort
    rest = (forgetting * least + returning) / speed
    return rest + (effort - rest) * math.exp(-speed * duration)

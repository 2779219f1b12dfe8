"""The tension of a rope that stretches: a linear spring and damper that never pushes.

With the length l, its free length x, the strain e = (l - x) / x and the rate s at which the piece is stretched:

    tau = E A e + D        for e > 0, else 0,       D = C s / x, but within -E A e and E A e

The limit of the damper's part keeps the tension from 0 up and makes it begin at 0 where the rope becomes taut.
"""

from __future__ import annotations

from dms_core.compiled.jit import compiled


@compiled
def stretch_tension(stiffness, damping, length, free, rate):
    """(tau, derivative by l, by x, by s); all 0 where the rope is slack.

    Args:
        stiffness: E A [N].
        damping: C [N s].
        length: l [m].
        free: x [m].
        rate: s [m/s].
    """
    if length <= free:
        return 0.0, 0.0, 0.0, 0.0
    elastic = stiffness * (length - free) / free
    by_length, by_free = stiffness / free, -stiffness * length / (free * free)
    damped = damping * rate / free
    if damped >= elastic:
        return 2.0 * elastic, 2.0 * by_length, 2.0 * by_free, 0.0
    if damped <= -elastic:
        return 0.0, 0.0, 0.0, 0.0
    return elastic + damped, by_length, by_free - damped / free, damping / free

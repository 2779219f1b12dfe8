"""First-order activation dynamics: from excitation u to activation a (Thelen 2003; Winters 1995).

    adot = (u - a) / tau(a),   tau = tau_act (0.5 + 1.5 a) for u > a,   tau_deact / (0.5 + 1.5 a) otherwise

Continuous, with a kink in slope at u = a. With u limited to [MINIMUM, 1] a solution that starts there stays there, so
the activation itself needs no limit; a Newton iterate far below 0 is kept from a vanishing time constant.
"""

from dms_core.compiled.jit import compiled

MINIMUM = 0.01
"""Least activation and excitation: a muscle is never fully silent, and its force stays invertible."""


@compiled
def limited(u):
    """The excitation within [MINIMUM, 1], and the derivative of that."""
    if u <= MINIMUM:
        return MINIMUM, 0.0
    if u >= 1.0:
        return 1.0, 0.0
    return u, 1.0


@compiled
def activation_rate(a, u, tau_act, tau_deact):
    """(adot [1/s], d adot/da, d adot/du)."""
    s, s_a = 0.5 + 1.5 * a, 1.5
    if a < 0.0:
        s, s_a = 0.5, 0.0
    if u > a:
        t = 1.0 / (tau_act * s)
        return (u - a) * t, -t - (u - a) * t * s_a / s, t
    return (u - a) * s / tau_deact, (-s + (u - a) * s_a) / tau_deact, s / tau_deact

"""Zeros of scalar functions between two points of opposite sign, for compiled loops that evaluate the function.

The Illinois method (Dowell and Jarratt 1971): false position, where an end that stays twice counts half. It converges
superlinearly and never leaves the bracket, which here has its negative value at the low end.
"""

from dms_core.compiled.jit import compiled


@compiled
def trial(low, f_low, high, f_high):
    """Where to evaluate next; outside of the open bracket only when no number is left in it."""
    x = (low * f_high - high * f_low) / (f_high - f_low)
    return x if low < x < high else 0.5 * (low + high)


@compiled
def narrowed(low, f_low, high, f_high, before, x, f):
    """Bracket behind an evaluation: (low, f_low, high, f_high, 1.0 where `high` moved, else -1.0).

    `before` is the last component of the bracket before, at first 0.0.
    """
    if f > 0.0:
        return low, f_low * (0.5 if before > 0.0 else 1.0), x, f, 1.0
    return x, f, high, f_high * (0.5 if before < 0.0 else 1.0), -1.0

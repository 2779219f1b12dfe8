"""Numbers as figures and films show them: with a prefix of the unit in place of a power of ten, and without "-0.0"."""

from __future__ import annotations

import math

PREFIXES = {-9: "n", -6: "\u00b5", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
"""SI prefix of each power of ten."""
PLAIN = ("deg", "-", "", "%")
"""Units that take no prefix."""
SMALLEST_PLAIN = 0.01
"""Numbers from here to 1000 need no prefix."""


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """A number with its unit, such as "14.7 kN/rad".

    Args:
        value: in the unit.
        unit: its first letter takes the prefix; "-" and "" are none.
        digits: that count.

    Example:
        >>> quantity(14742.0, "N/rad"), quantity(2.2e-6, "m"), quantity(0.45, "Nm"), quantity(-0.0, "N")
        ('14.7 kN/rad', '2.2 µm', '0.45 Nm', '0 N')
    """
    rounded = float(f"{value:.{digits}g}") + 0.0
    size, power = abs(rounded), 0
    # Weights are given in kilograms, whose prefix is taken.
    if unit not in (*PLAIN, "kg") and size > 0.0 and math.isfinite(size) and not SMALLEST_PLAIN <= size < 1000.0:
        power = min(max(3 * math.floor(math.log10(size) / 3.0), min(PREFIXES)), max(PREFIXES))
    number = rounded / 10.0**power
    whole = max(digits - 1 - math.floor(math.log10(abs(number))), 0) if number and math.isfinite(number) else 0
    text = f"{number:.{whole}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return f"{text} {PREFIXES[power]}{'' if unit == '-' else unit}".rstrip()


def fixed(value: float, decimals: int, *, sign: bool = False) -> str:
    """A number with so many decimals; what is rounded to zero has no sign.

    Example:
        >>> fixed(-0.04, 1), fixed(0.26, 1, sign=True), fixed(-0.04, 1, sign=True)
        ('0.0', '+0.3', '0.0')
    """
    text = f"{value:+.{decimals}f}" if sign else f"{value:.{decimals}f}"
    return text.lstrip("+-") if float(text) == 0.0 else text

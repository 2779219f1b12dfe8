"""Ends of what is shown in colours and over time, the same in all pictures that are compared."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from exo_env.rendering.scene import Scene

STEPS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""Round numbers of a decade."""
LEAST_ACTIVATION, LEAST_TENSION, LEAST_MOMENT = 0.1, 10.0, 1.0
"""Ends where next to nothing happens [-, N, Nm]."""


class Scales(NamedTuple):
    """Ends of the scales of a picture."""

    activation: float = 1.0
    """[-]."""
    tension: float = 200.0
    """[N]; without another one the largest of the action mode rope_tension."""

    @classmethod
    def spanning(cls, scenes: Sequence[Scene]) -> Scales:
        """Round numbers that what happens in some scenes, at least one, just fits below."""
        activation = max((a for scene in scenes for _, a in scene.muscles), default=0.0)
        tension = max((t for scene in scenes for _, t in scene.ropes), default=0.0)
        return cls(min(round_up(max(activation, LEAST_ACTIVATION)), 1.0), round_up(max(tension, LEAST_TENSION)))


def round_up(value: float) -> float:
    """The next round number from a positive one on.

    Example:
        >>> round_up(0.23), round_up(87.0), round_up(200.0)
        (0.3, 100.0, 200.0)
    """
    decade = 10.0 ** math.floor(math.log10(value))
    found = next(step for step in STEPS if step * decade >= value * (1.0 - 1e-9))
    # Without what a product with a power of ten leaves in the last digit.
    return float(f"{found * decade:.3g}")

"""What a filter did from one reading to the next, for tables and the smoother."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dms_core.estimation.estimated import Belief


@dataclass(frozen=True)
class Step:
    """What a filter did up to one event."""

    belief: Belief
    """Behind the readings."""
    predicted: Belief
    """Before them."""
    joint: np.ndarray | None
    """Cov(x of the step before, x predicted); None where the filter began here."""
    nis: float
    readings: int
    """Number of readings taken."""
    known: dict[int, float]
    """Values of known inputs with which the readings were taken, by their places."""

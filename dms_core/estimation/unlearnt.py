"""Whether a record tells what is estimated: inputs, constants and biases whose covariance no reading has changed.

Without readings the covariance of an input, constant or bias would be D. With them it is P <= D. A direction d with
d^T P d = d^T D d, an eigenvector of P d = k D d with k = 1, is one of which the record tells nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg as la

from dms_core.errors import InputError
from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.kalman import KalmanFilter

UNCHANGED = 0.999
"""Share of the variance without readings from which on a direction counts as untold."""
PART = 0.1
"""Share of the largest component from which on a name is part of a direction."""


def check_learnt(kalman: KalmanFilter, beliefs: Sequence[Belief]) -> None:
    """Refuse an estimate of which the record tells nothing.

    Args:
        kalman: the filter.
        beliefs: filtered, along a record.

    Raises:
        InputError: names the inputs, constants or biases, and the direction in which they are unknown.
    """
    names, m = kalman.estimated.rest_names, len(beliefs[0].rest)
    if not m:
        return
    variance = np.diag(kalman.start(beliefs[0].t).P)[-m:].copy()
    most = 1.0
    for k, belief in enumerate(beliefs):
        if k:
            dt = belief.t - beliefs[k - 1].t
            joins = np.diag(kalman.estimated.noise(belief.chart, dt))[-m:] if dt > 0.0 else 0.0
            variance = variance * kalman.estimated.factors(dt) ** 2 + joins
        # In at least one place of the record each direction must be told.
        scale = np.sqrt(variance)
        most = min(most, float(la.eigvalsh(belief.P[-m:, -m:] / np.outer(scale, scale))[-1]))
    if most > UNCHANGED:
        _refuse(kalman, names, beliefs, variance)


def _refuse(
    kalman: KalmanFilter, names: tuple[str, ...], beliefs: Sequence[Belief], variance: np.ndarray
) -> None:  # fmt: skip
    """Name the direction of which nothing is told."""
    m, scale = len(names), np.sqrt(variance)
    values, vectors = la.eigh(beliefs[-1].P[-m:, -m:] / np.outer(scale, scale))
    direction = vectors[:, -1] / vectors[np.argmax(np.abs(vectors[:, -1])), -1]
    parts = [(name, x) for name, x in zip(names, direction, strict=True) if abs(x) > PART]
    words = ", ".join(f"{x:+.2g} deviations of '{name}'" for name, x in parts)
    raise InputError(
        f"not observable: the readings of {', '.join(kalman.settings.channels)} tell nothing of {words}"
        f"{' at once' if len(parts) > 1 else ''} (variance {values[-1]:.4g} of that without readings). Leave "
        f"{'one of them' if len(parts) > 1 else 'it'} out, or add a sensor."
    )

"""Observability: what readings over a time tell of the state at its begin, and which directions they hardly tell.

    O = [C; C A1; C A2 A1; ...],    W = O^T O        (local: derivatives along the motion from the start)
    O = (y(x + e_j) - y(x - e_j)) / 2                (empirical: runs from displaced starts; Krener and Ide 2009)

Columns count in standard deviations of the start, rows in those of a reading, so that a singular value s of O says: a
start off by one deviation along this direction moves the readings by s deviations of their noise. Where s is 0 the
direction cannot be observed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from dms_core.analyses.motion_names import motion_in_words
from dms_core.errors import InputError
from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.kalman import KalmanFilter

RANK = 1e-7
"""Singular value, over the largest one, from which on a direction counts as observed: differences leave about 1e-9."""
PART = 0.1
"""Component of a direction from which on it is named."""
DISPLACED = 1e-3
"""Displacement of a start for the empirical Gramian, over its deviation."""


@dataclass(frozen=True)
class Direction:
    """A combination of states that readings tell together."""

    singular_value: float
    """Deviations of readings for one deviation of the start [-]."""
    share: dict[str, float]
    """Components in deviations of the start, by name."""
    words: str
    """What it moves."""


@dataclass(frozen=True)
class Observability:
    """Directions by falling singular value."""

    names: tuple[str, ...]
    directions: tuple[Direction, ...]

    @property
    def singular_values(self) -> np.ndarray:
        """Falling, shape (n,)."""
        return np.array([d.singular_value for d in self.directions])

    @property
    def rank(self) -> int:
        """Number of directions that are observed."""
        s = self.singular_values
        return int(np.sum(s > RANK * s[0])) if len(s) and s[0] > 0.0 else 0

    @property
    def unobservable(self) -> tuple[Direction, ...]:
        """Directions that readings do not tell."""
        return self.directions[self.rank :]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        said = [{"singular_value": d.singular_value, "moves": d.words, "components": d.share} for d in self.directions]
        return {"rank": self.rank, "states": list(self.names), "directions": said}


def local_observability(
    kalman: KalmanFilter, periods: int, start: Belief | None = None, progress: Callable[[float], None] | None = None
) -> Observability:
    """Observability by derivatives along the motion.

    Args:
        kalman: filter with the channels.
        periods: of the settings, over which is read; as many as there are states tell the rank at rest.
        start: where from; default: the model's start.
        progress: called with the time reached.

    Raises:
        SimulationError: the equations cannot be solved on the way.
    """
    belief = kalman.start() if start is None else start
    first, names = belief, list(kalman.settings.channels)
    noise = _noise(kalman)
    way, rows = np.diag(first.deviations), []
    for k in range(periods + 1):
        rows.append(kalman.expected(belief, names)[1] @ way / noise[:, None])
        if k < periods:
            predicted = kalman.predict(belief, first.t + (k + 1) * kalman.settings.period)
            way, belief = predicted.A @ way, predicted.belief
        if progress is not None:
            progress(belief.t)
    return _directions(kalman, first, np.vstack(rows))


def empirical_observability(
    kalman: KalmanFilter, periods: int, start: Belief | None = None, progress: Callable[[float], None] | None = None
) -> Observability:
    """Observability by runs from displaced starts; arguments as in `local_observability`."""
    first = kalman.start() if start is None else start
    columns, x, noise = [], first.mean, _noise(kalman)
    for j, deviation in enumerate(first.deviations):
        ends = []
        for sign in (1.0, -1.0):
            moved = x.copy()
            moved[j] += sign * DISPLACED * deviation
            ends.append(_readings(kalman, kalman.moved(first, moved), periods))
        columns.append((kalman.difference(ends[0], ends[1]) / (2.0 * DISPLACED) / noise).ravel())
        if progress is not None:
            progress(kalman.settings.period * periods * (j + 1) / len(x))
    return _directions(kalman, first, np.column_stack(columns))


def _noise(kalman: KalmanFilter) -> np.ndarray:
    """Standard deviations of the channels."""
    return np.sqrt([channel.variance for channel in kalman.settings.channels.values()])


def _readings(kalman: KalmanFilter, belief: Belief, periods: int) -> np.ndarray:
    """Channels along a motion without readings, shape (periods + 1, channels)."""
    names, found, begin = list(kalman.settings.channels), [], belief.t
    at, biases = [kalman.estimated.outputs[name] for name in names], kalman.estimated.biases(names)
    for k in range(periods + 1):
        found.append(kalman.read(belief)[at] + biases @ belief.rest)
        if k < periods:
            belief = kalman.moved_on(belief, begin + (k + 1) * kalman.settings.period)
    return np.array(found)


def _directions(kalman: KalmanFilter, first: Belief, matrix: np.ndarray) -> Observability:
    """Directions of an observability matrix in deviations."""
    if not np.isfinite(matrix).all():
        raise InputError("observability: readings grow beyond all bounds over this time; ask for fewer periods.")
    names, n = kalman.estimated.names(first.chart), matrix.shape[1]
    _, s, V = np.linalg.svd(np.vstack([matrix, np.zeros((n, n))]))
    found = []
    for value, direction in zip(s, V, strict=True):
        share = {name: float(x) for name, x in zip(names, direction, strict=True)}
        found.append(Direction(float(value), share, _words(kalman, first, direction)))
    return Observability(names, tuple(found))


def _words(kalman: KalmanFilter, first: Belief, direction: np.ndarray) -> str:
    """What a direction moves: motions in words, all else by name with its part."""
    chart, model = first.chart, kalman.model
    n, names = len(chart.chosen), kalman.estimated.names(chart)
    dx, said = direction * first.deviations, []
    for part, what in ((slice(0, n), ""), (slice(n, 2 * n), "rate: ")):
        if np.linalg.norm(direction[part]) > PART:
            dq = chart.N @ dx[part]
            said.append((np.linalg.norm(direction[part]), what + motion_in_words(model, first.q, dq)))
    for name, x in zip(names[2 * n :], direction[2 * n :], strict=True):
        if abs(x) > PART:
            said.append((abs(x), f"'{name}' ({x:+.2g})"))
    return "; ".join(words for _, words in sorted(said, key=lambda item: -item[0])) or "many states at once"

"""One plan of a patient from the numbers that were drawn for it: when the hand moves, where to, and with what."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exo_env.tasks.movements.repetition import HIGHEST, LOWEST
from exo_env.tasks.movements.submovements import UNIT

EARLIEST, LATEST = 0.3, 0.7
"""Parts of a move after which the patient may change mind [-]; assumed."""
BROKEN_OFF = 0.5
"""Share of these changes in which the hand goes back to where it came from, not elsewhere; assumed."""


class Move(NamedTuple):
    """What is drawn for one move; numbers without a unit are from 0 to 1."""

    amplitude_deg: float
    duration: float
    """[s]"""
    pause: float
    """At its target [s]."""
    picked_up: float
    """Mass of what is picked up at its target [kg]."""
    second_amplitude_deg: float
    """Of the move in another direction, where the patient changes mind."""
    second_duration: float
    """[s]"""
    way: float
    """Up or down."""
    changed: float
    """Whether the patient changes mind."""
    when: float
    elsewhere: float
    """Whether the hand then goes back or elsewhere."""
    second_way: float
    loaded: float
    """Whether the load changes at the target."""


class Plan:
    """A plan that grows window by window.

    Args:
        start_deg: angle at the start [deg].
        window: length of a window [s].
    """

    def __init__(self, start_deg: float, window: float) -> None:
        self.start_deg, self.window = start_deg, window
        self._at, self._windows, self._carried = start_deg, 0, 0.0
        self._units: list[tuple[float, float, float]] = []
        self._loads: list[tuple[float, float]] = []

    def add_window(self, rest: float, moves: Sequence[Move], changes_of_mind: float, load_changes: float) -> None:
        """Plan a further window; a move for whose whole there is no time left ends it.

        Args:
            rest: before the first move [s].
            moves: what is drawn for each.
            changes_of_mind: share of the moves that are not finished [-].
            load_changes: share of the pauses with a change of load [-].
        """
        now, end = self._windows * self.window + rest, (self._windows + 1) * self.window
        self._windows += 1
        for move in moves:
            if now + move.duration > end:
                return
            now = self._move(move, now, end, changes_of_mind)
            if move.loaded < load_changes and now + 0.5 * move.pause < end:
                self._change_load(now + 0.5 * move.pause, move.picked_up)
            now += move.pause

    def _move(self, move: Move, now: float, end: float, changes_of_mind: float) -> float:
        """Add a move, and a second one where mind is changed and there is time for it; gives when the hand arrives."""
        first, amplitude = self._at, _amplitude(self._at, move.amplitude_deg, move.way)
        self._units.append((now, move.duration, amplitude))
        self._at += amplitude
        begin = now + (EARLIEST + (LATEST - EARLIEST) * move.when) * move.duration
        arrival = now + move.duration
        # A second submovement that ended before the first one would overshoot.
        last = max(begin + move.second_duration, arrival)
        if not move.changed < changes_of_mind or last > end:
            return arrival
        back = move.elsewhere < BROKEN_OFF
        to = first if back else first + _amplitude(first, move.second_amplitude_deg, move.second_way)
        self._units.append((begin, last - begin, to - self._at))
        self._at = to
        return last

    def _change_load(self, time: float, mass: float) -> None:
        """Pick something up with an empty hand, or put down what was picked up."""
        change = mass if self._carried == 0.0 else -self._carried
        self._loads.append((time, change))
        self._carried += change

    def row(self, units: int, loads: int) -> np.ndarray:
        """The plan as numbers: start, `units` submovements, `loads` changes of load, zeros where there are fewer."""
        found = np.zeros((units, len(UNIT)))
        found[:, UNIT.duration] = 1.0
        found[: len(self._units)] = np.reshape(self._units, (-1, len(UNIT)))
        changes = np.zeros((loads, 2))
        changes[: len(self._loads)] = np.reshape(self._loads, (-1, 2))
        # Changes that do not take place stand behind all others.
        changes[len(self._loads) :, 0] = self._windows * self.window
        return np.concatenate([[self.start_deg], found.ravel(), changes.ravel()])


def _amplitude(at: float, size: float, way: float) -> float:
    """Amplitude [deg] with its sign: up or down by chance where both are possible, else where there is room for it."""
    up, down = HIGHEST - at, at - LOWEST
    if size <= min(up, down):
        return size if way < 0.5 else -size
    return min(size, up) if up >= down else -min(size, down)

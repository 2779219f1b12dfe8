"""A world that keeps what its derivatives need: times of all accepted steps, states at some, how inputs were set."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dms_core.assembly.model import Model
from dms_core.assembly.tables import Signals, with_settings
from dms_core.compiled.arena import Packed
from dms_core.model.system import System
from dms_core.sensitivity.tangents.tables import KIND
from dms_core.simulation.dynamics import BUFFER_ROWS, World
from dms_core.simulation.options import SolverOptions
from dms_core.simulation.snapshot import Mark, Snapshot
from dms_core.simulation.state import COUNTS

MOST_STATES = 32768
"""States kept; beyond that every second one is dropped, and what lies between is computed again when asked for."""


class Row(NamedTuple):
    """A recorded time: the end of a step, or a start behind a jump, where the state is that of the row before."""

    t: float
    start: bool


class RecordedWorld(World):
    """A World whose whole run can be differentiated, see `Sensitivity`.

    Memory is bounded: times are kept of all steps, states of at most MOST_STATES of them.

    Args:
        model: a compiled Model, or a System to compile.
        options: solver options.
    """

    def __init__(self, model: Model | System, options: SolverOptions | None = None) -> None:
        super().__init__(model, options)
        self._buffer = np.zeros((BUFFER_ROWS, self._buffer.shape[1]))
        self._forget()

    def _forget(self) -> None:
        """Begin the record at the present."""
        self.times: list[float] = []
        self.stride = 1
        self._kept: dict[int, np.ndarray] = {}
        self._last = np.zeros((2, 2 * self.model.n_q))
        self._settings: dict[int, list[tuple[float, float]]] = {}
        self._orders: list[tuple[int, Packed]] = []

    def _hold(self, k: int, value: float) -> bool:
        before = float(self.state.signals.c[self.state.signals.ptr[k], 0])
        jump = super()._hold(k, value)
        if jump:
            self._settings.setdefault(k, [(-1.0, before)]).append((self.time, value))
        return jump

    def _keep(self, rows: np.ndarray) -> None:
        if len(rows) and (not self._orders or self._orders[-1][1] is not self._tables):
            # The step that ends in the first of these rows began at the row before.
            self._orders.append((max(len(self.times) - 1, 0), self._tables))
        n = 2 * self.model.n_q
        for row in rows:
            k, t = len(self.times), float(row[0])
            begins = not self.times or t == self.times[-1]
            self._last = np.array([row[1 : 1 + n], self._last[1 if begins else 0]])
            if k % self.stride == 0:
                self._kept[k] = self._last
            self.times.append(t)
            if len(self._kept) > MOST_STATES:
                self.stride *= 2
                self._kept = {k: x for k, x in self._kept.items() if k % self.stride == 0}

    def restore(self, past: Snapshot) -> None:
        """As in World. The record begins there, and so does the method."""
        super().restore(past)
        self._forget()
        self.state.counts[COUNTS.restart] = 1

    def mark(self) -> Mark:
        """As in World, with the length of the record."""
        return super().mark()._replace(rows=len(self.times))

    def rewind(self, past: Mark) -> None:
        """As in World: the record is cut there, and the method begins afresh."""
        super().rewind(past)
        del self.times[past.rows :]
        self._kept = {k: x for k, x in self._kept.items() if k < past.rows}
        self._settings = {k: [s for s in x if s[0] <= past.time] for k, x in self._settings.items()}
        self._orders = [x for x in self._orders if x[0] < max(past.rows, 1)]
        self._last = np.array([np.concatenate([self.state.q, self.state.v])] * 2)
        self.state.counts[COUNTS.restart] = 1

    @property
    def signals(self) -> Signals:
        """The inputs over the whole record, those that were set as the steps they made."""
        return with_settings(self.state.signals, self._settings)

    def kept(self, k: int) -> np.ndarray:
        """(q, v) at row k, which is a multiple of `stride`, and at the row before, shape (2, 2 n_q)."""
        return self._kept[k]

    def known(self, k: int) -> np.ndarray | None:
        """As `kept`; None where the row is not kept."""
        return self._kept.get(k)

    def row(self, k: int) -> Row:
        """Row k."""
        return Row(self.times[k], k == 0 or self.times[k] == self.times[k - 1])

    def kind(self, k: int) -> int:
        """How the step that begins at row k was made, a place in Kind; -1 for Radau IIA."""
        if self.options.method == "radau5":
            return -1
        return KIND.sdirk2 if self.row(k).start or self.options.method == "sdirk2" else KIND.bdf2

    @property
    def reordered(self) -> list[int]:
        """Rows from which on steps were solved with other tables."""
        return [first for first, _ in self._orders]

    def tables_at(self, k: int) -> Packed:
        """Tables that the step which begins at row k was solved with."""
        return next(tables for first, tables in reversed(self._orders) if first <= max(k, 0))

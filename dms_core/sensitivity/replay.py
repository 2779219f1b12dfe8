"""Recorded steps taken again, each solved to rounding and differentiated."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple, NoReturn

import numpy as np

from dms_core.assembly.derivatives.blocks import OperatingPoint
from dms_core.compiled.arena import Packed
from dms_core.errors import SimulationError
from dms_core.sensitivity.nodes import Node, Number, node
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.tangents.radau import RadauStep
from dms_core.sensitivity.tangents.reading_tables import SomeReadings, calls_of, reads_welds
from dms_core.sensitivity.tangents.readings import pull_back
from dms_core.sensitivity.tangents.steps import carry_back, carry_forward, differentiated_step
from dms_core.sensitivity.tangents.stretch import (
    put_end,
    put_row,
    read_back,
    size,
    steps_back,
    steps_forward,
    take_again,
)
from dms_core.sensitivity.tangents.tables import CLOSEST, NUMBERS, new_differentials, new_movement
from dms_core.simulation.dynamics import World
from dms_core.simulation.iteration.addresses import part_addresses
from dms_core.simulation.iteration.parts import PARTS, run_rates, set_inputs
from dms_core.simulation.state import new_state


class Stretch(NamedTuple):
    """Recorded rows behind each other, see stretch.py."""

    times: np.ndarray
    rows: np.ndarray
    kinds: np.ndarray


class Along(NamedTuple):
    """Sums of sensors that outputs take on their way, as integrals do."""

    rows: Sequence[int]
    """Components that are read."""
    sums: np.ndarray
    """How they are summed: shape (outputs, len(rows))."""
    shares: np.ndarray
    """How much of that counts at each recorded row."""


class Replay(World):
    """The steps of a record, in any order.

    Args:
        record: a world that has run.
        numbers: declared numbers to differentiate by.
        inputs: indices of the inputs to differentiate by.
    """

    def __init__(self, record: RecordedWorld, numbers: Sequence[Number] = (), inputs: Collection[int] = ()) -> None:
        super().__init__(record.model, record.options)
        self.record, self.inputs = record, frozenset(inputs)
        self.numbers = tuple(numbers)
        self.directions = [self.model.parameter_derivatives.direction(*number) for number in self.numbers]
        self._radau: RadauStep | None = None
        self._signals = record.signals
        self._segment: tuple[int, list[np.ndarray]] = (-1, [])
        self._use(record.tables_at(0))

    def _use(self, tables: Packed) -> None:
        """Rows and orders of elimination of a step."""
        start = self.model.start
        radau = self.options.method == "radau5"
        self._tables = tables
        self._world = new_state(
            tables.values, self.model.new_work(), self._signals, part_addresses(radau), start.q, start.v, radau
        )
        self.state = self._world.values
        self._movements = [new_movement(tables.values, x) for x in self.directions]
        self.differentials = new_differentials(self.model, tables.values, self.state.w, self._movements, CLOSEST)
        self._readings: dict[tuple[int, ...], SomeReadings] = {}

    def state_at(self, k: int) -> np.ndarray:
        """(q, v) at row k and at the row before, shape (2, 2 n_q), by steps from the kept row ahead of it."""
        first = k - k % self.record.stride
        if first == k:
            return self.record.kept(k)
        if self._segment[0] != first:
            states = [self.record.kept(first)]
            for j in range(first, min(first + self.record.stride, len(self.record.times)) - 1):
                if self.record.row(j + 1).start:
                    states.append(states[-1])
                    continue
                self._take(self._stretch_from(j, states[-1]), 1, known=False, differentiated=False)
                states.append(np.array([np.concatenate([self.state.q, self.state.v]), states[-1][0]]))
            self._segment = first, states
        return self._segment[1][k - first]

    def _stretch_from(self, k: int, x: np.ndarray) -> Stretch:
        """The step that begins at row k in the state x, of which the end is not known."""
        self._use_tables_of(k)
        times = self.record.times
        rows = np.array([x[1], x[0], x[0]])
        return Stretch(np.array([times[max(k - 1, 0)], *times[k : k + 2]]), rows, self._kinds(k, k + 1))

    def _stretch(self, first: int, last: int) -> Stretch:
        """Recorded rows first to last."""
        times, states = self.record.times, [self.state_at(k) for k in range(first, last + 1)]
        self._use_tables_of(first)
        rows = np.array([states[0][1], *(x[0] for x in states)])
        return Stretch(np.array([times[max(first - 1, 0)], *times[first : last + 1]]), rows, self._kinds(first, last))

    def _kinds(self, first: int, last: int) -> np.ndarray:
        """How the steps from row first to row last are made, of which the first alone may start anew."""
        kinds = np.full(last - first + 1, self.record.kind(last - 1), np.int64)
        kinds[1] = self.record.kind(first)
        return kinds

    def _use_tables_of(self, k: int) -> None:
        if self.record.tables_at(k) is not self._tables:
            self._use(self.record.tables_at(k))

    def step(self, k: int, x: np.ndarray | None = None) -> None:
        """Take the step that begins at row k again and differentiate it.

        Args:
            k: a row that a step begins at.
            x: the state there and one row before, as from `state_at`; None: the recorded ones.

        Raises:
            SimulationError: the step cannot be solved again.
        """
        self._take(self._stretch(k, k + 1) if x is None else self._stretch_from(k, x), 1, x is None)

    def _take(self, stretch: Stretch, j: int, known: bool, differentiated: bool = True) -> None:
        """Step j of a stretch.

        Args:
            stretch: rows behind each other.
            j: the row that the step begins at.
            known: whether the row behind it is its end.
            differentiated: whether derivatives are taken, or the state at the end alone is asked for.
        """
        d = self.differentials.values
        d.numbers[NUMBERS.state_only] = not differentiated
        solved = self._again(stretch, j, known) or self._again_from_afar(stretch, j)
        d.numbers[NUMBERS.state_only] = 0.0
        if not solved:
            raise SimulationError(
                f"system '{self.model.system.name}': the recorded step from t = {stretch.times[j]:.6g} s to "
                f"{stretch.times[j + 1]:.6g} s cannot be solved again."
            )

    def _again(self, stretch: Stretch, j: int, known: bool) -> bool:
        m, s, d = self._tables.table, self._world.table, self.differentials.table
        if self.options.method != "radau5":
            return bool(take_again(m, s, self._numbers, d, stretch.times, stretch.rows, j, stretch.kinds[j], known))
        put_row(s, stretch.times, stretch.rows, j)
        if known:
            put_end(s, d, stretch.times, stretch.rows, j)
        self._radau = RadauStep(self, self.numbers, float(size(stretch.times, j)))
        return self._radau.solved

    def _again_from_afar(self, stretch: Stretch, j: int) -> bool:
        """From a fresh start of the method: accelerations and multipliers that belong to it."""
        m, s, d = self._tables.table, self._world.table, self.differentials
        put_row(s, stretch.times, stretch.rows, j)
        d.values.numbers[NUMBERS.known] = 0.0
        set_inputs(m, s, stretch.times[j], False)
        if not run_rates(m, s, PARTS.consistent_rates, 0.0):
            return False
        h = float(size(stretch.times, j))
        if self.options.method == "radau5":
            self._radau = RadauStep(self, self.numbers, h)
            return self._radau.solved
        return bool(differentiated_step(m, s, self._numbers, d.table, h, stretch.kinds[j]))

    def forward(self, columns: Packed, first: int, last: int) -> None:
        """The columns from row first to row last, through steps none of which but the first may start anew.

        Raises:
            SimulationError: a step cannot be solved again.
        """
        stretch = self._stretch(first, last)
        m, s, d, j = self._tables.table, self._world.table, self.differentials.table, 1
        while True:
            if self.options.method != "radau5":
                j = steps_forward(m, s, self._numbers, d, columns.table, *stretch, j)
            if j == last - first + 1:
                return
            self._take(stretch, j, True)
            if self._radau is not None:
                self._radau.forward(columns.values)
            else:
                carry_forward(m, d, columns.table)
            j += 1

    def back(self, adjoints: Packed, first: int, last: int, along: Along) -> None:
        """The adjoints from row last to row first, as `forward`, with what sensors add on the way.

        Raises:
            SimulationError: a step cannot be solved again, or no accelerations belong to a row.
        """
        stretch = self._stretch(first, last)
        shares = np.concatenate([[0.0], along.shares[first : last + 1]])
        readings = self._some_readings(along.rows).packed
        m, s, d, j = self._tables.table, self._world.table, self.differentials.table, last - first + 1
        while True:
            if self.options.method == "radau5":
                j = read_back(m, s, d, adjoints.table, readings.table, along.sums, shares, *stretch[:2], j)
            else:
                j = steps_back(m, s, self._numbers, d, adjoints.table, readings.table, along.sums, shares, *stretch, j)
            if j < 0:
                self._refuse_rates(stretch.times[-j])
            if j == 1:
                return
            self._take(stretch, j - 1, True)
            if self._radau is not None:
                self._radau.back(adjoints.values)
            else:
                carry_back(m, d, adjoints.table)
            j -= 1

    def _refuse_rates(self, t: float) -> NoReturn:
        raise SimulationError(
            f"system '{self.model.system.name}': no finite accelerations belong to the state at t = {t:.6g} s."
        )

    def point(self, k: int) -> OperatingPoint:
        """Row k with the accelerations, first-order rates and multipliers that belong to it.

        Inputs are those before a jump, or those behind it at a row that starts anew.

        Raises:
            SimulationError: no accelerations belong to the state.
        """
        x, times = self.state_at(k), self.record.times
        self._use_tables_of(k)
        behind, t = self.record.row(k).start, times[k]
        m, s = self._tables.table, self._world.table
        put_row(s, np.array([times[max(k - 1, 0)], t]), x[::-1].copy(), 1)
        set_inputs(m, s, t, not behind)
        if not run_rates(m, s, PARTS.consistent_rates, 0.0):
            self._refuse_rates(t)
        return self.operating_point(behind)

    def reads_on_the_way(self, row: int) -> bool:
        """Whether compiled code alone gives the derivatives of this component of a sensor, as `back` needs."""
        return not reads_welds(self.model, calls_of(self.model, [row])) and not self._through_moments([row])

    def _through_moments(self, rows: Sequence[int]) -> bool:
        """Whether a shifted input moves any of these components through an element whose moment it sums."""
        return bool(self.inputs & self.model.derivatives.inputs.moments_read(rows))

    def _some_readings(self, rows: Sequence[int]) -> SomeReadings:
        """Tables of these components of sensors."""
        key = tuple(rows)
        if key not in self._readings:
            self._readings[key] = SomeReadings(self.model, rows, self.state.w, self.directions)
        return self._readings[key]

    def node(self, k: int, rows: Sequence[int]) -> Node:
        """These components of sensors at row k, by states, inputs and declared numbers.

        Raises:
            SimulationError: no accelerations belong to the state, or a derivative is not finite.
        """
        point = self.point(k)
        if reads_welds(self.model, calls_of(self.model, rows)):
            return node(self.model, point, np.array(rows, int), self.numbers, self.directions)
        readings = self._some_readings(rows)
        if not pull_back(self._tables.table, self._world.table, self.differentials.table, readings.packed.table):
            self._refuse_rates(self.time)
        b, y = readings.found, readings.packed.values.y
        by_u = b.au[:, ::3].copy()
        if self._through_moments(rows):
            by_u += self.model.derivatives.moments_by_inputs(point, rows)[:, :, 0]
        return Node(y.copy(), b.aq.copy(), b.av.copy(), by_u, b.ap.copy())

"""Recorded steps taken again, each solved to rounding and differentiated."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dms_core.assembly.derivatives.blocks import OperatingPoint
from dms_core.compiled.arena import Packed
from dms_core.errors import SimulationError
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.tangents.radau import RadauStep
from dms_core.sensitivity.tangents.steps import carry_back, carry_forward, differentiated_step
from dms_core.sensitivity.tangents.tables import CLOSEST, NUMBERS, new_differentials, new_movement
from dms_core.simulation.dynamics import World
from dms_core.simulation.iteration.addresses import part_addresses
from dms_core.simulation.iteration.parts import PARTS, run_rates, set_inputs
from dms_core.simulation.state import CLOCK, COUNTS, new_state


class Replay(World):
    """The steps of a record, in any order.

    Args:
        record: a world that has run.
        numbers: declared numbers to differentiate by.
    """

    def __init__(self, record: RecordedWorld, numbers: Sequence[Number] = ()) -> None:
        super().__init__(record.model, record.options)
        self.record = record
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
                self.step(j, states[-1])
                states.append(np.array([np.concatenate([self.state.q, self.state.v]), states[-1][0]]))
            self._segment = first, states
        return self._segment[1][k - first]

    def _put(self, k: int, x: np.ndarray) -> None:
        """Row k into the world, without rates."""
        if self.record.tables_at(k) is not self._tables:
            self._use(self.record.tables_at(k))
        s, n, times = self.state, self.model.n_q, self.record.times
        s.q[:], s.v[:] = x[0, :n], x[0, n:]
        s.q_before[:], s.v_before[:] = x[1, :n], x[1, n:]
        s.qd[:] = s.v
        s.vd[:] = 0.0
        s.lam_before[:] = s.lam
        s.mu[:] = 0.0
        s.clock[CLOCK.t] = times[k]
        s.clock[CLOCK.h_before] = times[k] - times[k - 1] if k else 0.0
        s.counts[COUNTS.restart] = 0

    def _guess(self, k: int) -> None:
        """The recorded end of the step that begins at row k, where it is kept, and the acceleration to it."""
        d, n, s = self.differentials.values, self.model.n_q, self.state
        end = self.record.known(k + 1)
        d.numbers[NUMBERS.known] = end is not None
        if end is not None:
            d.end_q[:], d.end_v[:] = end[0, :n], end[0, n:]
            s.vd[:] = (d.end_v - s.v) / (self.record.times[k + 1] - self.record.times[k])

    def step(self, k: int, x: np.ndarray | None = None) -> float:
        """Take the step that begins at row k again and differentiate it; gives its size [s].

        Args:
            k: a row that a step begins at.
            x: the state there, as from `state_at`.

        Raises:
            SimulationError: the step cannot be solved again.
        """
        self._put(k, self.state_at(k) if x is None else x)
        self._guess(k)
        t, end = self.record.times[k : k + 2]
        h = end - t
        # A step must not end behind a jump of the inputs, not even by rounding.
        while t + h > end:
            h = math.nextafter(h, 0.0)
        if not self._differentiate(k, h) and not self._differentiate_from_afar(k, h, x):
            raise SimulationError(
                f"system '{self.model.system.name}': the recorded step from t = {t:.6g} s to {end:.6g} s cannot be "
                "solved again."
            )
        return h

    def _differentiate_from_afar(self, k: int, h: float, x: np.ndarray | None) -> bool:
        """As `_differentiate`, from a fresh start of the method: accelerations and multipliers that belong to it."""
        self._put(k, self.state_at(k) if x is None else x)
        self.differentials.values.numbers[NUMBERS.known] = 0.0
        m, s = self._tables.table, self._world.table
        set_inputs(m, s, self.record.times[k], False)
        return bool(run_rates(m, s, PARTS.consistent_rates, 0.0)) and self._differentiate(k, h)

    def _differentiate(self, k: int, h: float) -> bool:
        if self.options.method == "radau5":
            self._radau = RadauStep(self, self.numbers, h)
            return self._radau.solved
        kind, o = self.record.kind(k), self._numbers
        tables = self._tables.table, self._world.table
        return bool(differentiated_step(*tables, o, self.differentials.table, h, kind))

    def forward(self, columns: Packed) -> None:
        """The columns through the step that was taken last."""
        if self._radau is not None:
            self._radau.forward(columns.values)
            return
        carry_forward(self._tables.table, self.differentials.table, columns.table)

    def back(self, adjoints: Packed) -> None:
        """The adjoints through the step that was taken last."""
        if self._radau is not None:
            self._radau.back(adjoints.values)
            return
        carry_back(self._tables.table, self.differentials.table, adjoints.table)

    def point(self, k: int) -> OperatingPoint:
        """Row k with the accelerations, first-order rates and multipliers that belong to it.

        Inputs are those before a jump, or those behind it at a row that starts anew.

        Raises:
            SimulationError: no accelerations belong to the state.
        """
        self._put(k, self.state_at(k))
        behind, t = self.record.row(k).start, self.record.times[k]
        m, s = self._tables.table, self._world.table
        set_inputs(m, s, t, not behind)
        if not run_rates(m, s, PARTS.consistent_rates, 0.0):
            raise SimulationError(
                f"system '{self.model.system.name}': no accelerations belong to the state at t = {t:.6g} s."
            )
        return self.operating_point(behind)

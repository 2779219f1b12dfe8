"""Tangents along recorded steps of a world: from state, ramps of inputs and declared numbers to the state behind."""

from __future__ import annotations

import numpy as np

from dms_core.compiled.arena import Packed
from dms_core.errors import SimulationError
from dms_core.sensitivity.tangents.chart import lift, new_chart
from dms_core.sensitivity.tangents.tables import new_columns, new_differentials, new_movement
from dms_core.simulation.iteration.addresses import part_addresses
from dms_core.simulation.state import new_state
from exo_env.gradients.kernels import carry_steps
from exo_env.gradients.maps import Map
from exo_env.gradients.numbers import Moved
from exo_env.gradients.vector import Vector
from exo_env.patient.excitation.effort import TICK
from exo_env.tables import STATUS
from exo_env.world.world import PatientWorld


class Tangents:
    """Tangents of one world, carried by a state beside its own.

    Args:
        world: the world.
        vector: places of all numbers.
    """

    def __init__(self, world: PatientWorld, vector: Vector) -> None:
        self.world, self.vector, at = world, vector, vector.at
        drive, patient, signals = world.tables.drive, world.tables.patient, world.dynamics.state.signals
        self._signals = np.concatenate([drive.rows, patient.rows])
        self._inputs = np.searchsorted(signals.ptr, self._signals, "right") - 1
        self._lengths = np.concatenate([np.full(len(drive.rows), world.period), np.full(len(patient.rows), TICK)])
        pairs = [
            np.stack([at[f"{name}_before"], at[name]], axis=1).ravel() for name in ("commands", "excitations")
        ]  # fmt: skip
        self.ends = np.concatenate(pairs)
        """Places of the values at both ends of each ramp, in turns."""
        self._moved: Moved | None = None
        self._load = np.nan
        self._chart: Packed | None = None
        self._columns: Packed
        self.states: np.ndarray
        """Places of the independent states that the tangents began with."""
        self.reorder()

    def reorder(self) -> None:
        """Storage for the rows and orders that the world is solved with now."""
        world, model = self.world.dynamics, self.world.model
        self._tables, s = world.tables, world.state
        self._state = new_state(
            self._tables.values, model.new_work(), s.signals, part_addresses(), s.q.copy(), s.v.copy()
        )  # fmt: skip
        self._state.values.lam[:] = s.lam
        self._renew_movements()

    def _renew_movements(self) -> None:
        directions = [] if self._moved is None else self._moved.directions
        self._movements = [new_movement(self._tables.values, x) for x in directions]
        model, work = self.world.model, self._state.values.w
        self._differentials = new_differentials(model, self._tables.values, work, self._movements)

    def renew(self, moved: Moved | None) -> None:
        """Take over what declared numbers move, and other rows and orders."""
        load = float(self.world.tables.plan.loads[self.world.tables.status[STATUS.step]])
        changed = moved is not self._moved or (moved is not None and load != self._load)
        self._moved, self._load = moved, load
        if self.world.dynamics.tables is not self._tables:
            self.reorder()
        elif changed:
            self._renew_movements()

    def _ramps(self) -> np.ndarray:
        begins = self.world.dynamics.state.signals.t[self._signals]
        return np.column_stack([self._inputs, begins, self._lengths]).astype(float)

    def _begin(self, row: np.ndarray) -> None:
        """Columns of independent states, of both ends of ramps and of declared numbers at a recorded state."""
        s, n = self._state.values, self.world.model.n_q
        s.q[:], s.v[:] = row[1 : 1 + n], row[1 + n :]
        tables = self._tables.table, self._state.table
        if self._chart is None or not lift(*tables, self._chart.table, self._columns.table):
            self._chart = new_chart(self.world.model, s.q, float(row[0]))
            at, n_p = self._chart.values, len(self.vector.at["numbers"])
            self.states = np.concatenate([at.chosen, n + at.chosen, at.first])
            first = len(self.states) + len(self.ends)
            self._columns = new_columns(self.world.model, first + n_p)
            self._columns.values.parameter[first:] = np.arange(n_p)
            if not lift(*tables, self._chart.table, self._columns.table):
                raise SimulationError(
                    f"At t = {row[0]:.6g} s no coordinates tell the others, as in a singular position."
                )
        c = self._columns.values
        c.dq[len(self.states) :], c.dv[len(self.states) :] = 0.0, 0.0

    def carry(self, rows: np.ndarray, count: int, first: bool) -> None:
        """Carry the tangents along recorded steps; with `first` they begin there.

        Raises:
            SimulationError: a step cannot be solved again.
        """
        if first:
            self._begin(rows[0])
        tables, o = (self._tables.table, self._state.table), self.world.dynamics.options.numbers()
        d, c = self._differentials.table, self._columns.table
        done = carry_steps(*tables, o, d, c, rows, count, self._ramps(), len(self.states))
        if done < count - 1:
            raise SimulationError(f"The step from t = {rows[done, 0]:.6g} s cannot be solved again.")

    def map(self) -> Map:
        """The map of the steps since the tangents began."""
        at, c = self.vector.at, self._columns.values
        read = np.concatenate([self.states, self.ends, at["numbers"]])
        return Map(np.concatenate([at["q"], at["v"]]), read, np.hstack([c.dq, c.dv]).T.copy())

    def input_slopes(self, by_input: np.ndarray, t: float) -> np.ndarray:
        """By the values at both ends of each ramp, from derivatives by inputs at time t [s], shape (n, 2 ramps)."""
        ramps = self._ramps()
        gone = (t - ramps[:, 1]) / ramps[:, 2]
        both = np.stack([1.0 - gone, gone], axis=1)
        return (by_input[:, self._inputs, None] * both).reshape(len(by_input), -1)

"""The map of one step in independent coordinates: x_(n+1) = A x_n + B u, for filters and for tests of whole runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dms_core.analyses.independent import state_names
from dms_core.compiled.arena import Packed
from dms_core.errors import InputError, SimulationError
from dms_core.sensitivity.tangents.chart import Chart, lift, new_chart
from dms_core.sensitivity.tangents.steps import carry_forward, differentiated_step
from dms_core.sensitivity.tangents.tables import KIND, Columns, new_columns, new_differentials
from dms_core.simulation.dynamics import World
from dms_core.simulation.iteration.parts import restart
from dms_core.simulation.options import is_positive
from dms_core.simulation.state import COUNTS


@dataclass(frozen=True)
class StepMatrices:
    """dx at the end of a step = A dx at its begin + A_before dx one step before + B du + B_rate dudot + ...

    An input that is moved is moved at all stages of the step.
    """

    h: float
    """Size of the step [s]."""
    A: np.ndarray
    """Shape (n_x, n_x)."""
    A_before: np.ndarray
    """By the state one step before, 0 for methods of one step."""
    B: np.ndarray
    """By values of inputs, shape (n_x, n_u)."""
    B_rate: np.ndarray
    B_acceleration: np.ndarray
    states: tuple[str, ...]
    """As in `Linearisation`: 'q.<coordinate>', 'v.<coordinate>', then 'q.<state>' of first-order states."""
    inputs: tuple[str, ...]


class StepMap:
    """Steps a world and gives the map of each step.

    The columns of the compiled layer are in all coordinates, so that maps of steps compose there without a chart; the
    chart, made where the map is made, enters at the two ends only. It is made anew where it no longer holds.

    Args:
        world: a world; its steps are SDIRK2, or BDF2 where that is its method and it has a past. Steps are solved to
            rounding, whatever its tolerances.

    Raises:
        InputError: the world runs Radau IIA.
        ModelError: a constraint reads a first-order state.
    """

    def __init__(self, world: World) -> None:
        if world.options.method == "radau5":
            raise InputError("Expected a world that runs 'sdirk2' or 'bdf2' for a step map, got 'radau5'.")
        self.world = world
        self.inputs = tuple(world.model.layout.input_index)
        self._renew()
        self._renew_chart()

    def _renew(self) -> None:
        """Storage for the rows and orders that the world is solved with now."""
        model, self._tables = self.world.model, self.world.tables
        self.differentials = new_differentials(model, self._tables.values, self.world.state.w)

    def _renew_chart(self) -> None:
        """The chart of the coordinates that tell the others best now."""
        model, world = self.world.model, self.world
        self.chart: Packed = new_chart(model, world.state.q, world.time)
        at: Chart = self.chart.values
        self.states = state_names(model, at.chosen, at.first)
        self.columns = new_columns(model, 2 * len(self.states) + 3 * len(self.inputs))
        self.lifted: tuple[np.ndarray, np.ndarray] | None = None
        """dq and dv of each state at the begin of the last step, shape (n_x, n_q) twice."""

    def step(self, h: float) -> StepMatrices:
        """One step of size h [s] of the world, and its map; the chart is the same at both ends.

        Raises:
            InputError: h is not positive.
            SimulationError: the step cannot be solved.
        """
        if not is_positive(h):
            raise InputError(f"Expected a positive step [s], got {h}.")
        world = self.world
        if world.tables is not self._tables:
            self._renew()
        m, s, o = world.tables.table, world.packed.table, world.options.numbers()
        if world.state.counts[COUNTS.restart] and not restart(m, s, o):
            raise SimulationError(f"{self._where()}: no accelerations belong to the state.")
        if not lift(m, s, self.chart.table, self.columns.table):
            self._renew_chart()
            if not lift(m, s, self.chart.table, self.columns.table):
                raise SimulationError(f"{self._where()}: no coordinates tell the others, as in a singular position.")
        n_x, n_u, c = len(self.states), len(self.inputs), self.columns
        # BDF2 needs the tangents of the step before, which a new chart does not have: its first step is one of SDIRK2.
        past = self.lifted is not None and not world.state.counts[COUNTS.restart] and world.stats().steps
        kind = KIND.bdf2 if world.options.method == "bdf2" and past else KIND.sdirk2
        self._load(n_x, n_u, kind)
        here = (c.values.dq[:n_x].copy(), c.values.dv[:n_x].copy())
        if not differentiated_step(m, s, o, self.differentials.table, h, kind):
            raise SimulationError(f"{self._where()}: a step of {h:.6g} s cannot be solved.")
        carry_forward(m, self.differentials.table, c.table)
        self.lifted = here
        return self._matrices(h, n_x, n_u)

    def _where(self) -> str:
        return f"step map of system '{self.world.model.system.name}' at t = {self.world.time:.6g} s"

    def _load(self, n_x: int, n_u: int, kind: int) -> None:
        """Columns behind those of x: x one step before, then values, rates and second derivatives of inputs."""
        c: Columns = self.columns.values
        count = len(c.dq)
        for x in (c.dq, c.dv):
            x[n_x:] = 0.0
        for x in (c.dq_before, c.dv_before, c.du):
            x[:] = 0.0
        if kind == KIND.bdf2 and self.lifted is not None:
            c.dq_before[n_x : 2 * n_x], c.dv_before[n_x : 2 * n_x] = self.lifted
        for k in range(n_u):
            for j in range(3):
                column = 2 * n_x + j * n_u + k
                c.du[column, 3 * k + j] = c.du[count + column, 3 * k + j] = 1.0

    def _matrices(self, h: float, n_x: int, n_u: int) -> StepMatrices:
        at, c = self.chart.values, self.columns.values
        x = np.concatenate([c.dq[:, at.chosen], c.dv[:, at.chosen], c.dq[:, at.first]], axis=1).T
        cuts = [n_x, 2 * n_x, 2 * n_x + n_u, 2 * n_x + 2 * n_u]
        A, A_before, B, B_rate, B_acceleration = (part.copy() for part in np.split(x, cuts, axis=1))
        return StepMatrices(h, A, A_before, B, B_rate, B_acceleration, self.states, self.inputs)

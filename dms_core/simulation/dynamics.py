"""Running a model in time: one call for a whole run, or a simulation that is advanced and steered step by step."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from dms_core.assembly.model import Model
from dms_core.assembly.tables import with_settings
from dms_core.compiled.arena import Packed, inner
from dms_core.errors import InputError, SimulationError
from dms_core.flags import Flag, Limits
from dms_core.model.signals import Constant
from dms_core.model.system import System
from dms_core.results import Result, SolveStats, Trajectory
from dms_core.simulation.events import Crossing, advance_to_crossing
from dms_core.simulation.failure import explain
from dms_core.simulation.iteration.addresses import part_addresses
from dms_core.simulation.iteration.parts import advance, restart
from dms_core.simulation.iteration.rescue import HELPED, Place, Rescue
from dms_core.simulation.options import SolverOptions, is_positive
from dms_core.simulation.rates_between import rates_between
from dms_core.simulation.slack import SlackSimulation, refuse_unilateral, unilateral_ropes
from dms_core.simulation.snapshot import Ending, Mark, Snapshot, go_back, mark
from dms_core.simulation.state import CLOCK, COUNTS, LARGEST, STATE, State, new_state
from dms_core.simulation.step_control import OUTCOME

BUFFER_ROWS = 256
"""Steps recorded between two returns to Python: short enough for a smooth progress bar."""

WHOLE = 1e-6
"""Share of a step by which rounding may shorten the last one of many."""

RESULT_OF = {
    OUTCOME.done: Result.SUCCESS,
    OUTCOME.buffer_full: Result.SUCCESS,
    OUTCOME.step_too_small: Result.STEP_TOO_SMALL,
    OUTCOME.newton_failed: Result.NEWTON_FAILED,
    OUTCOME.matrix_singular: Result.MATRIX_SINGULAR,
    OUTCOME.too_many_steps: Result.TOO_MANY_STEPS,
    OUTCOME.rates_failed: Result.RATES_FAILED,
}


class World(Rescue):
    """One world that is advanced in time, with inputs set between calls; it remembers the present only.

    Args:
        model: a compiled Model, or a System to compile.
        options: solver options.
    """

    def __init__(self, model: Model | System, options: SolverOptions | None = None) -> None:
        self.model = model if isinstance(model, Model) else Model(model)
        refuse_unilateral(self.model.system)
        self.options = options or SolverOptions()
        self._numbers = self.options.numbers()
        self._tables: Packed = self.model.tables
        start, radau = self.model.start, self.options.method == "radau5"
        self._world = new_state(
            self._tables.values, self.model.new_work(), self.model.new_signals(), part_addresses(radau),
            start.q, start.v, radau,
        )  # fmt: skip
        self.state: State = self._world.values
        self._buffer = np.zeros((0, 1 + 3 * self.model.n_q + 2 * self.model.n_phi))
        self.result = Result.SUCCESS
        self.crossing: Crossing | None = None
        """What ended the last call of `advance`, where that was an event."""
        self.crossed_at = -math.inf
        """When that was [s]."""
        self._singular = self._why = ""

    @property
    def ending(self) -> Ending:
        """How the last call of `advance` ended, beside its result: what a snapshot holds of it."""
        return Ending(self.crossing, self.crossed_at, self._why)

    @ending.setter
    def ending(self, past: Ending) -> None:
        self.crossing, self.crossed_at, self._why = past

    @property
    def tables(self) -> Packed:
        """Constant tables (a packed Tables) that this world is solved with, for compiled code."""
        return self._tables

    @property
    def packed(self) -> Packed:
        """The mutable state (a packed State), for compiled code."""
        return self._world

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.state.clock[CLOCK.t])

    def set_input(self, name: str, value: float) -> None:
        """Hold the input `name` at `value` from now on; the method starts afresh behind the jump.

        Raises:
            InputError: the value is not finite, or the input is declared as a course in time.
        """
        k = self.model.input_index(name)
        if name in self.model.layout.driven:
            by = self.model.layout.driven[name].rpartition(".")[0]
            raise InputError(f"input '{name}' is driven by '{by}'; only an input that nothing drives can be set.")
        signal = self.model.system.inputs[k].signal
        if not isinstance(signal, Constant):
            raise InputError(
                f"input '{name}' is declared as a function of time ({signal.kind}); only a constant input can be set."
            )
        if not math.isfinite(value):
            raise InputError(f"input '{name}': Expected a finite number, got {value}.")
        self._hold(k, float(value))

    def _hold(self, k: int, value: float) -> bool:
        """Set input k, unchecked; True if that is a jump."""
        row = self.state.signals.ptr[k]
        if self.state.signals.c[row, 0] == value:
            return False
        self.state.signals.c[row, 0] = value
        self.state.counts[COUNTS.restart] = 1
        return True

    def advance(
        self,
        t_end: float,
        progress: Callable[[float], None] | None = None,
        stop_at: Crossing | Sequence[Crossing] = (),
    ) -> Result:
        """Step until t_end [s]; `progress` is called with the time reached now and then.

        Args:
            t_end: end [s].
            progress: called with the time reached.
            stop_at: sensors whose passing of a value ends the call before t_end, see `Crossing`; `crossing` is then
                the one that did. The last step lands on it.

        Returns:
            SUCCESS, or what stopped the run: what was computed is kept and finite.
        """
        if stop_at:
            self.result, self.crossing = advance_to_crossing(self, t_end, stop_at, progress)
            return self.result
        return self._solve(t_end, progress)

    def advance_once(self, t_end: float, progress: Callable[[float], None] | None = None) -> Result:
        """One step towards t_end [s], or to it; as `advance` otherwise."""
        return self._solve(t_end, progress, True)

    def _solve(self, t_end: float, progress: Callable[[float], None] | None, once: bool = False) -> Result:
        """Step until t_end, or `once`, with other rows and orders of elimination where those at hand fail."""
        self.crossing = None
        if not (t_end == 0.0 or is_positive(t_end)) or t_end < self.time:
            raise InputError(f"t_end: Expected a time of at least the present {self.time:.6g} s, got {t_end} s.")
        try:
            tried: set[Place] = set()
            code = self._advance(float(t_end), progress, once)
            while code in HELPED and self._help(code, tried):
                code = self._advance(float(t_end), progress, once)
        except KeyboardInterrupt:
            self.result = Result.INTERRUPTED
            return self.result
        self.result, self._why = explain(self.model, self._tables, self._world, RESULT_OF[code], self._singular)
        return self.result

    def _advance(self, t_end: float, progress: Callable[[float], None] | None, once: bool) -> int:
        """Step until t_end, or once, draining the record; gives a code of OUTCOME."""
        # There is room for one step: where it begins, if that is behind a jump, and where it ends.
        buffer = np.zeros((2, self._buffer.shape[1])) if once else self._buffer
        while True:
            code, count = advance(self._tables.table, self._world.table, self._numbers, t_end, buffer, 0)
            self._keep(buffer[:count])
            if progress is not None:
                progress(self.time)
            if once or code != OUTCOME.buffer_full:
                return code

    def mark(self) -> Mark:
        """The present, to be put back to with `rewind`."""
        return mark(self._tables, self.state, self.result, self.ending)

    def rewind(self, past: Mark) -> None:
        """Go back to a mark; what was recorded since is forgotten."""
        self._world = go_back(past, self._tables, self._world)
        self._tables, self.state, self.result = past.tables, self._world.values, past.result
        self.ending = past.ending

    def _keep(self, rows: np.ndarray) -> None:
        """Take over recorded steps; a world that remembers the present only does nothing."""

    def settle(self) -> Result:
        """Accelerations and multipliers of the present state under the present inputs, for reading before a step."""
        code = restart(self._tables.table, self._world.table, self._numbers)
        self.result = Result.SUCCESS if code else Result.RATES_FAILED
        return self.result

    def read(self, out: np.ndarray | None = None) -> np.ndarray:
        """All sensors at the present time, in the order of model.layout.outputs, shape (n_y,); into `out` if given.

        Multipliers are those of the independent rows: with redundant constraints, reactions here are not of least norm.
        """
        s = self.state
        y = np.empty(len(self.model.layout.outputs)) if out is None else out
        present = np.zeros(1, bool)
        self.model.measure_into(
            inner(self._world.table, STATE.signals),
            np.array([self.time]),
            s.q[None],
            s.v[None],
            s.vd[None],
            s.lam[None],
            present,
            y[None],
        )
        return y

    def flags(self) -> tuple[Flag, ...]:
        """Elements that are outside the range they are meant for at the present time, see `Trajectory.flags`."""
        s, at = self.state, self.operating_point()
        lam = self.model.unique_multipliers(s.q[None], at.lam[None])
        return Limits(self.model).left(np.array([self.time]), s.q[None], lam, at.u[None, :, 0])

    @property
    def message(self) -> str:
        """How the last call of `advance` ended, in sentences: where it went wrong, or which steps were shorter."""
        message, asked, shortest = self.result.value, self.options.fixed_step, self.stats().smallest_step
        if self.result is Result.SUCCESS and self.crossing is not None:
            message = f"The run ended where '{self.crossing.sensor}' passed {self.crossing.value:g}."
        if self.result is not Result.SUCCESS:
            return f"{message} Stopped at t = {self.time:.6g} s.{self._why}"
        if asked and 0.0 < shortest < asked * (1.0 - WHOLE):
            message += (
                f" Steps of {asked:.6g} s; the shortest, which ends on a jump of an input or on an end time that is no "
                f"multiple of that, is {shortest:.6g} s."
            )
        return message

    def stats(self) -> SolveStats:
        """Counts and worst errors so far."""
        c, x = self.state.counts, self.state.largest
        return SolveStats(
            steps=int(c[COUNTS.steps]),
            rejected_error=int(c[COUNTS.rejected_error]),
            rejected_newton=int(c[COUNTS.rejected_newton]),
            newton_iterations=int(c[COUNTS.iterations]),
            factorisations=int(c[COUNTS.factorisations]),
            restarts=int(c[COUNTS.restarts]),
            largest_phi=float(x[LARGEST.phi]),
            largest_phi_v=float(x[LARGEST.phi_v]),
            largest_mu=float(x[LARGEST.mu]),
            smallest_step=float(x[LARGEST.h_least]) if c[COUNTS.steps] else 0.0,
            largest_step=float(x[LARGEST.h_most]),
        )


class Simulation(World):
    """A world that remembers: everything computed is there as a trajectory.

    Args:
        model: a compiled Model, or a System to compile.
        options: solver options.
    """

    def __init__(self, model: Model | System, options: SolverOptions | None = None) -> None:
        super().__init__(model, options)
        self._buffer = np.zeros((BUFFER_ROWS, self._buffer.shape[1]))
        self._rows: list[np.ndarray] = []
        self._settings: dict[int, list[tuple[float, float]]] = {}

    def _hold(self, k: int, value: float) -> bool:
        before = float(self.state.signals.c[self.state.signals.ptr[k], 0])
        jump = super()._hold(k, value)
        if jump:
            self._settings.setdefault(k, [(-1.0, before)]).append((self.time, value))
        return jump

    def _keep(self, rows: np.ndarray) -> None:
        self._rows.append(rows.copy())

    def restore(self, past: Snapshot) -> None:
        """As in World. What was recorded is forgotten: the trajectory begins at the restored time.

        Raises:
            InputError: the snapshot belongs to another model, to other numbers of it, or to other options.
        """
        super().restore(past)
        s = self.state
        self._settings = {}
        # At the start and behind a jump the next step records where it begins, with rates that belong to it.
        present = np.concatenate([[self.time], s.q, s.v, s.vd, s.lam, s.mu])
        self._rows = [present[None]] if not s.counts[COUNTS.restart] else []

    def mark(self) -> Mark:
        """The present, to be put back to with `rewind`."""
        return super().mark()._replace(rows=len(self._rows))

    def rewind(self, past: Mark) -> None:
        """Go back to a mark; what was recorded since is forgotten, and what was recorded before is kept."""
        super().rewind(past)
        self._rows = self._rows[: past.rows]

    def record(self) -> np.ndarray:
        """Steps so far: t, q, v, vdot, lam, mu, a row each."""
        return np.concatenate([np.zeros((0, self._buffer.shape[1])), *self._rows])

    def trajectory(self) -> Trajectory:
        """Everything computed so far.

        Raises:
            SimulationError: nothing was computed.
            KeyboardInterrupt: nothing was computed, as the user stopped it before.
        """
        if not self._rows or not sum(len(r) for r in self._rows):
            if self.result is Result.INTERRUPTED:
                raise KeyboardInterrupt
            raise SimulationError(f"nothing was computed: {self.message}")
        signals = with_settings(self.state.signals, self._settings)
        rates = rates_between if self.options.method == "radau5" else None
        return Trajectory(
            self.model, signals, np.concatenate(self._rows), self.result, self.stats(), self.message, rates
        )


def new_simulation(model: Model | System, options: SolverOptions | None = None) -> Simulation | SlackSimulation:
    """A simulation from the assembled start; one with ropes that may go slack cannot be steered on its way."""
    if not unilateral_ropes(model if isinstance(model, System) else model.system):
        return Simulation(model, options)
    return SlackSimulation(Simulation, model, options)


def simulate(
    model: Model | System,
    t_end: float,
    options: SolverOptions | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Run a model from its assembled start to t_end [s].

    Example:
        >>> trajectory = simulate(system, 2.0, SolverOptions(rtol=1e-6))
        >>> trajectory.at([0.5, 1.0]).coordinate("rod.x")

    Raises:
        InputError: t_end is not positive, an option is out of range, or the fixed step is longer than the run.
    """
    if not is_positive(t_end):
        raise InputError(f"t_end: Expected a positive time, got {t_end} s.")
    if options is not None and options.fixed_step is not None and options.fixed_step > t_end:
        raise InputError(
            f"solver option fixed_step: Expected at most t_end = {t_end} s, got {options.fixed_step} s: a run of one "
            "step, cut short, would say nothing about the step that was asked for."
        )
    simulation = new_simulation(model, options)
    simulation.advance(t_end, progress)
    return simulation.trajectory()

"""Running a model in time: one call for a whole run, or a simulation that is advanced and steered step by step."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dms_core.assembly.finite import FAR, far_numbers, open_call, sentence
from dms_core.assembly.model import Model
from dms_core.assembly.tables import MODEL, Tables, with_settings
from dms_core.compiled.arena import Packed, inner
from dms_core.errors import InputError, ModelError, SimulationError
from dms_core.flags import Flag, Limits
from dms_core.model.signals import Constant
from dms_core.model.system import System
from dms_core.results import Result, SolveStats, Trajectory
from dms_core.simulation.addresses import part_addresses
from dms_core.simulation.inspection import Inspection
from dms_core.simulation.options import SolverOptions, is_positive
from dms_core.simulation.parts import advance, restart
from dms_core.simulation.rates_between import rates_between
from dms_core.simulation.snapshot import Snapshot
from dms_core.simulation.state import CLOCK, COUNTS, LARGEST, STATE, State, new_state, with_tables
from dms_core.simulation.step_control import OUTCOME

BUFFER_ROWS = 256
"""Steps recorded between two returns to Python: short enough for a smooth progress bar."""

WHOLE = 1e-6
"""Share of a step by which rounding may shorten the last one of many."""

RESULT_OF = {
    OUTCOME.done: Result.SUCCESS,
    OUTCOME.step_too_small: Result.STEP_TOO_SMALL,
    OUTCOME.newton_failed: Result.NEWTON_FAILED,
    OUTCOME.matrix_singular: Result.MATRIX_SINGULAR,
    OUTCOME.too_many_steps: Result.TOO_MANY_STEPS,
    OUTCOME.rates_failed: Result.RATES_FAILED,
}


class World(Inspection):
    """One world that is advanced in time, with inputs set between calls; it remembers the present only.

    Args:
        model: a compiled Model, or a System to compile.
        options: solver options.
    """

    def __init__(self, model: Model | System, options: SolverOptions | None = None) -> None:
        self.model = model if isinstance(model, Model) else Model(model)
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
        self._singular = ""

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

    def advance(self, t_end: float, progress: Callable[[float], None] | None = None) -> Result:
        """Step until t_end [s]; `progress` is called with the time reached now and then.

        Returns:
            SUCCESS, or what stopped the run: what was computed is kept and finite.
        """
        if not (t_end == 0.0 or is_positive(t_end)) or t_end < self.time:
            raise InputError(f"t_end: Expected a time of at least the present {self.time:.6g} s, got {t_end} s.")
        try:
            code, stuck = self._advance(float(t_end), progress), -math.inf
            while code == OUTCOME.matrix_singular:
                if not (self.reorder() if self.time > stuck else self._shorten()):
                    break
                stuck = self.time
                code = self._advance(float(t_end), progress)
        except KeyboardInterrupt:
            self.result = Result.INTERRUPTED
            return self.result
        self.result = RESULT_OF[code]
        return self.result

    def _advance(self, t_end: float, progress: Callable[[float], None] | None) -> int:
        """Step until t_end, draining the record; gives a code of OUTCOME."""
        code = OUTCOME.buffer_full
        while code == OUTCOME.buffer_full:
            code, count = advance(self._tables.table, self._world.table, self._numbers, t_end, self._buffer, 0)
            self._keep(self._buffer[:count])
            if progress is not None:
                progress(self.time)
        return code

    def _keep(self, rows: np.ndarray) -> None:
        """Take over recorded steps; a world that remembers the present only does nothing."""

    def reorder(self) -> bool:
        """Choose rows and pivots anew where the old ones became singular; False if nothing helps."""
        s = self.state
        try:
            self._tables = self.model.reordered(s.q, s.v, self.time, s.signals)
        except ModelError as error:
            self._singular = str(error)
            return False
        self._world = with_tables(self._tables.values, s)
        self.state = self._world.values
        return True

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

    def _shorten(self) -> bool:
        """A quarter of the step for a matrix that is singular far from the present state; False below the smallest."""
        clock = self.state.clock
        clock[CLOCK.h_wanted] *= 0.25
        return self.options.fixed_step is None and bool(clock[CLOCK.h_wanted] > self.options.h_min)

    @property
    def message(self) -> str:
        """How the last call of `advance` ended, in sentences: where it went wrong, or which steps were shorter."""
        message, asked, shortest = self.result.value, self.options.fixed_step, self.stats().smallest_step
        if self.result is not Result.SUCCESS:
            return f"{message} Stopped at t = {self.time:.6g} s.{self._culprit()}"
        if asked and 0.0 < shortest < asked * (1.0 - WHOLE):
            message += (
                f" Steps of {asked:.6g} s; the shortest, which ends on a jump of an input or on an end time that is no "
                f"multiple of that, is {shortest:.6g} s."
            )
        return message

    def _culprit(self) -> str:
        """Where the last attempt at a step failed, as a sentence with a space before it; empty where nothing did."""
        if self.result in (Result.SUCCESS, Result.INTERRUPTED):
            return ""
        table = self._tables.table
        dynamics, constraints = inner(table, MODEL.dynamics), inner(table, MODEL.constraints)
        far = far_numbers(self.model.system) + self._far_inputs()
        call = open_call(self.model.layout, dynamics, constraints, inner(self._world.table, STATE.w))
        if call is not None:
            return f" {sentence(self.model.layout, call)}"
        if self.result is Result.MATRIX_SINGULAR and self._singular:
            return f" There {self._singular}{far}"
        name = widest_coordinate(self.model, self._tables.values, self.state, self.result is Result.RATES_FAILED)
        kind = self.model.system.element(name.rpartition(".")[0]).kind
        where = "Steps are held small first by" if self.result is Result.TOO_MANY_STEPS else "It goes wrong first at"
        return f" {where} '{name}' ({kind}).{far}"

    def _far_inputs(self) -> str:
        """The inputs that were set so far from 1 that they may be why a run failed; as `far_numbers`."""
        values = zip(self.model.layout.input_index, self.state.w.u[:, 0], strict=True)
        far = [f"'{name}' = {x}" for name, x in values if abs(x) > 10.0**FAR]
        return f" Look at inputs far from 1 in SI units: {', '.join(far)}." if far else ""

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


def widest_coordinate(model: Model, tables: Tables, state: State, rates: bool) -> str:
    """Name of the coordinate that the last attempt changed most, over its tolerance, or over its size for rates."""
    free = tables.free
    if rates:
        change = np.abs(state.rate_x[: len(free)]) / tables.scale_v[free]
    else:
        change = np.abs(state.w.q[free] - state.q_guess[free]) / state.wq[free]
    change[~np.isfinite(change)] = np.inf
    return model.layout.names[free[int(np.argmax(change))]]


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
    simulation = Simulation(model, options)
    simulation.advance(t_end, progress)
    return simulation.trajectory()

"""Ropes of fixed length that may go slack: a run in phases, in each of which a rope is either taut or not there.

Between two events the equations are those of a system with the taut ropes alone, so that nothing of a step knows about
slackness. A phase ends exactly where the tension of a taut rope falls to 0, or where the path of a slack one has grown
to its length. The rope is then left out, or taken up with an impact that leaves no speed along it,

    M (v+ - v-) + phi_q^T P = 0,     phi_q v+ + phi_t = 0

with the impulses P of all joints and taut ropes; a rope that would have to push in it (P < 0) goes slack. The record of
a run has the time of an event twice, with the values before and behind it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from dms_core.assembly.layout import GROUND_COORDINATES
from dms_core.assembly.model import Model
from dms_core.assembly.tables import Signals
from dms_core.errors import InputError, ModelError, SimulationError
from dms_core.model.constraints.rope_length import RopeLength
from dms_core.model.geometry.path import path_length, start_length
from dms_core.model.ropes.pushing import NO_TENSION
from dms_core.model.system import System
from dms_core.results import Result, SolveStats, Trajectory
from dms_core.simulation.events import Crossing, advance_to_zero
from dms_core.simulation.options import SolverOptions
from dms_core.simulation.rates_between import rates_between
from dms_core.simulation.state import CLOCK

SLACK_START = 1e-9
"""Length that a rope may have beyond its path at the start [m]: what rounding leaves."""
MOST_EVENTS = 10_000
"""Events after which a run gives up: a rope that goes slack and taut ever faster."""


def unilateral_ropes(system: System) -> list[RopeLength]:
    """Ropes of fixed length that may go slack."""
    return [c for c in system.constraints if isinstance(c, RopeLength) and c.unilateral]


def refuse_unilateral(system: System) -> None:
    """Refuse a system whose ropes go slack where it is advanced by hand.

    Raises:
        ModelError: names the rope.
    """
    if ropes := unilateral_ropes(system):
        raise ModelError(
            f"rope_length '{ropes[0].name}': unilateral = true: its phases are solved by `simulate` and the command "
            "line. Expected a rope that holds both ways, or an elastic_rope, where a World is advanced by hand.",
            ropes[0].name,
        )


def _system(system: System, taut: frozenset[str]) -> System:
    """The same system with these of its unilateral ropes, as ones that hold both ways, and without the others."""
    constraints = [
        c.model_copy(update={"unilateral": False}) if isinstance(c, RopeLength) and c.unilateral else c
        for c in system.constraints
        if not (isinstance(c, RopeLength) and c.unilateral) or c.name in taut
    ]
    return System(
        system.name, bodies=system.bodies, constraints=constraints, forces=system.forces, sensors=_held(system),
        inputs=system.inputs,
    )  # fmt: skip


def _held(system: System) -> tuple:
    """No sensors: those of a rope that is not there would have nothing to read, and the whole model has them all."""
    read = {p.reads for f in system.forces for p in f.placements(system)}
    return tuple(
        s for s in system.sensors if any((f"{s.name}.{part}" if part else s.name) in read for part, _ in s.outputs())
    )


class SlackSimulation:
    """A run with ropes that may go slack, from the assembled start.

    Args:
        simulation: the class Simulation.
        model: a compiled Model, or a System to compile.
        options: solver options.

    Raises:
        ModelError: a rope is slack at the start.
    """

    def __init__(self, simulation: Any, model: Model | System, options: SolverOptions | None = None) -> None:
        self.model = model if isinstance(model, Model) else Model(model)
        self.options = options or SolverOptions()
        self._simulation, self._models = simulation, dict[frozenset[str], Model]()
        self._ropes = {rope.name: rope for rope in unilateral_ropes(self.model.system)}
        self._calls = {c.element.name: c for c in self.model.layout.constraints if c.element.name in self._ropes}
        for rope in self._ropes.values():
            _check_taut(self.model.system, rope)
        self.taut = frozenset(self._ropes)
        """Names of the ropes that are taut."""
        self.time, self.result = 0.0, Result.SUCCESS
        self._q, self._v = self.model.start.q.copy(), self.model.start.v.copy()
        self._record: list[np.ndarray] = []
        self._stats: list[SolveStats] = []
        self._phases: list[tuple[float, Model]] = []
        """End [s] and model of each phase so far."""
        self._message = ""
        self._signals: Any = self.model.new_signals()

    def advance(
        self, t_end: float, progress: Callable[[float], None] | None = None, stop_at: Sequence[Crossing] = ()
    ) -> Result:
        """Step until t_end [s] through all events; `progress` is called with the time reached now and then.

        Raises:
            InputError: an event of the user's own is asked for.
        """
        if stop_at:
            raise InputError(
                "stop_at: Expected no event in a run with ropes that may go slack, whose events end phases."
            )
        for _ in range(MOST_EVENTS):
            if self.time >= t_end:
                return self.result
            phase = self._phase()
            loose = [name for name in self._ropes if name not in self.taut]
            taut = sorted(self.taut)
            rows = [_row_of(phase, name) for name in taut]

            def read(phase=phase, rows=rows, loose=loose) -> np.ndarray:  # noqa: ANN001
                return np.concatenate([phase.state.lam[rows], [self._excess(phase, name) for name in loose]])

            # A rope that was let go has no excess yet, and one that was taken up may have no tension yet.
            on = np.abs(read()) <= np.repeat([NO_TENSION, SLACK_START], [len(taut), len(loose)])
            ways = [-1] * len(taut) + [1] * len(loose)
            # A jump of an input may let a rope go at once: a phase ends there too.
            jumps = self._signals.jumps
            stop = min([t_end, *jumps[jumps > self.time]])
            self.result, which = advance_to_zero(phase, stop, read, ways, list(on), progress)
            self._take(phase)
            if self.result is not Result.SUCCESS:
                return self.result
            if which is not None and which < len(taut):
                self.taut -= {taut[which]}
            elif which is not None:
                self._take_up(loose[which - len(taut)])
        raise SimulationError(
            f"a rope goes slack and taut more than {MOST_EVENTS} times; the run stopped at t = {self.time:.6g} s."
        )

    def trajectory(self) -> Trajectory:
        """Everything computed so far, of the whole model: a slack rope has the tension 0.

        Raises:
            SimulationError: nothing was computed.
            KeyboardInterrupt: nothing was computed, as the user stopped it before.
        """
        if not self._record:
            if self.result is Result.INTERRUPTED:
                raise KeyboardInterrupt
            raise SimulationError(f"nothing was computed: {self._message}")
        record = np.concatenate(self._record)
        rates = self._rates_between if self.options.method == "radau5" else None
        return Trajectory(self.model, self._signals, record, self.result, _sum(self._stats), self._message, rates)

    def _rates_between(
        self, model: Model, signals: Signals, times: np.ndarray, *guess: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `rates_between`, with the equations of the phase that each time lies in; at an event of the one before."""
        q, v, a, lam = (np.array(x, float) for x in guess)
        which = np.searchsorted([end for end, _ in self._phases], times)
        for k in np.unique(which):
            here, phase = which == k, self._phases[min(k, len(self._phases) - 1)][1]
            rows = self._rows_of(phase)
            v[here], a[here], found = rates_between(
                phase, signals, times[here], q[here], v[here], a[here], lam[np.ix_(here, rows)]
            )
            lam[here] = 0.0
            lam[np.ix_(here, rows)] = found
        return v, a, lam

    def _rows_of(self, phase: Model) -> np.ndarray:
        """Place of each constraint row of a phase among those of the whole model."""
        place = {name: k for k, name in enumerate(self.model.layout.row_names)}
        return np.array([place[name] for name in phase.layout.row_names], int)

    def _excess(self, phase: Any, name: str) -> float:
        """Length of the path of a slack rope beyond that of the rope [m]."""
        call = self._calls[name]
        q = np.concatenate([phase.state.q, GROUND_COORDINATES])[call.iq]
        ip, par = np.array(call.placement.integers, np.int32), np.array(call.placement.numbers)
        psi = phase.operating_point().u[call.iu[0], 0] if len(call.iu) else par[0]
        return float(path_length(ip, 1, par, 1, q) - psi)

    def _phase(self) -> Any:
        """A simulation of the taut ropes from the present state; ropes that would push at once are let go."""
        while True:
            phase = self._with(self.taut)
            if not self.taut or phase.settle() is not Result.SUCCESS:
                return phase
            rows = {name: _row_of(phase, name) for name in self.taut}
            name = min(rows, key=lambda n: phase.state.lam[rows[n]])
            if phase.state.lam[rows[name]] >= -NO_TENSION:
                return phase
            self.taut -= {name}

    def _with(self, taut: frozenset[str]) -> Any:
        """A simulation of these taut ropes from the present state."""
        if taut not in self._models:
            self._models[taut] = Model(_system(self.model.system, taut))
        phase = self._simulation(self._models[taut], self.options)
        phase.state.q[:], phase.state.v[:] = self._q, self._v
        phase.state.clock[CLOCK.t] = self.time
        return phase

    def _take(self, phase: Any) -> None:
        """Keep what a phase has computed, in the rows of the whole model."""
        self.time, self._message = phase.time, phase.message
        self._q, self._v = phase.state.q.copy(), phase.state.v.copy()
        self._stats.append(phase.stats())
        self._phases.append((phase.time, phase.model))
        rows = phase.record()
        n, m, own = self.model.n_q, self.model.n_phi, phase.model.n_phi
        whole = np.zeros((len(rows), 1 + 3 * n + 2 * m))
        whole[:, : 1 + 3 * n] = rows[:, : 1 + 3 * n]
        for k in (0, 1):
            whole[:, 1 + 3 * n + k * m + self._rows_of(phase.model)] = rows[
                :, 1 + 3 * n + k * own : 1 + 3 * n + (k + 1) * own
            ]
        self._record.append(whole)

    def _take_up(self, name: str) -> None:
        """The impact with which a rope becomes taut; ropes that would have to push in it are let go."""
        taut = self.taut | {name}
        while True:
            phase = self._with(taut)
            point = phase.operating_point(behind=True)
            blocks = phase.blocks(point)
            bodies = phase.model.layout.of_bodies
            rows = phase.model.active_rows
            M, G = blocks.r2_a.toarray()[:bodies, :bodies], blocks.phi_q.toarray()[rows][:, :bodies]
            left = np.concatenate([np.zeros(bodies), -blocks.r4[rows]])
            solved = np.linalg.solve(np.block([[M, G.T], [G, np.zeros((len(rows),) * 2)]]), left)
            impulse = dict(zip((phase.model.layout.row_names[k] for k in rows), solved[bodies:], strict=True))
            pushing = [n for n in taut if impulse[f"{n}.length"] < 0.0]
            if not pushing:
                self._v[:bodies] += solved[:bodies]
                self.taut = taut
                return
            taut -= {min(pushing, key=lambda n: impulse[f"{n}.length"])}


def _row_of(phase: Any, name: str) -> int:
    """Constraint row of a taut rope in a phase."""
    return phase.model.layout.row_names.index(f"{name}.length")


def _check_taut(system: System, rope: RopeLength) -> None:
    """Refuse a rope that is longer than its path at the start."""
    path = start_length(system, rope.path)
    if rope.length is not None and rope.length > path + SLACK_START:
        raise ModelError(
            f"rope_length '{rope.name}': length = {rope.length} m: Expected at most {path:.9g} m, its path at the "
            "start poses, as a rope that may go slack starts taut; declare an elastic_rope to start with a slack one.",
            rope.name,
        )


def _sum(parts: list[SolveStats]) -> SolveStats:
    """Counts of all phases together, and the worst of their errors."""
    tables = [asdict(p) for p in parts]
    found: dict[str, Any] = {}
    for key in tables[0]:
        values = [t[key] for t in tables]
        used = [x for x in values if x > 0.0] or [0.0]
        found[key] = (
            min(used) if key == "smallest_step" else max(values) if isinstance(values[0], float) else sum(values)
        )
    return SolveStats(**found)

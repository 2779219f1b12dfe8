"""Derivatives of a whole run: outputs by initial states, inputs and declared numbers, forward and by adjoints.

The run is differentiated as it was computed: its recorded steps are taken again, of the same sizes, each solved to
rounding. Forward carries one column for each of `by` and suits few of them; the adjoint carries one row for each of
`of`, and its cost does not depend on how many `by` there are. Both give the same numbers.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dms_core.analyses.independent import state_names
from dms_core.errors import InputError, ModelWarning, choices
from dms_core.model.contact.contact import Contact
from dms_core.sensitivity.nodes import Node, Number, node, start_columns
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.replay import Replay
from dms_core.sensitivity.tangents.tables import new_adjoints, new_columns


@dataclass(frozen=True)
class Output:
    """A number that a run gives: a state or a sensor at a time, or the integral of a sensor.

    Attributes:
        name: 'q.<coordinate>' or 'v.<coordinate>', or the name of a sensor's output. Rates of first-order states are
            no states; a sensor may read them.
        time: when [s], a time that a step ended at; None: at the end. Ahead of a jump of the inputs, if there is one.
        integral: over the whole run, by the trapezoidal rule over its steps.
    """

    name: str
    time: float | None = None
    integral: bool = False


@dataclass(frozen=True)
class Start:
    """An independent state at the start, named as in `Linearisation.states`; the others follow by the constraints."""

    state: str


@dataclass(frozen=True)
class Shift:
    """A number that is added to an input from `begin` to `end` [s], both times that steps ended at."""

    input: str
    begin: float = 0.0
    end: float = np.inf


By = Start | Shift | Number


class Sensitivity:
    """Derivatives of one recorded run.

    Args:
        record: a world that has run.
        of: what is differentiated.
        by: what it is differentiated by. By a declared number, independent states at the start stay what they are.

    Raises:
        InputError: a name is unknown, or a time is none that a step ended at.

    Example:
        >>> world = RecordedWorld(model, SolverOptions(method="sdirk2"))
        >>> world.advance(1.0)
        >>> run = Sensitivity(world, [Output("elbow.angle")], [Number("forearm", "mass"), Start("q.forearm.x")])
        >>> run.adjoint()
    """

    def __init__(self, record: RecordedWorld, of: Sequence[Output], by: Sequence[By]) -> None:
        if len(record.times) < 2:
            raise InputError(f"system '{record.model.system.name}': nothing was computed; advance the world first.")
        self.record, self.model, self.of, self.by = record, record.model, tuple(of), tuple(by)
        self.numbers = tuple(dict.fromkeys(x for x in self.by if isinstance(x, Number)))
        self.replay = Replay(record, self.numbers)
        spans = [(x.begin, x.end) if isinstance(x, Shift) else (np.inf, np.inf) for x in self.by]
        # A shift begins and ends with recorded steps, to the last bit.
        ends = [[record.times[self._row_at(t)] if np.isfinite(t) else t for t in span] for span in spans]
        self._begin, self._end = np.array(ends).reshape(-1, 2).T
        self._known: dict[int, Node] = {}
        self._start = start_columns(self.model, self.replay.point(0), self.numbers)
        at = self._start[0]
        self.states = state_names(self.model, at.chosen, at.first)
        for output in self.of:
            if not self._is_state(output):
                self._sensor(output)
        self._weights = self._weighted()
        self.by_start: tuple[np.ndarray, np.ndarray] | None = None
        """Behind `adjoint`: by q and v at the start in all coordinates, shape (k, n_q) twice."""
        self._check()
        _warn_of_contact(record)

    def _is_state(self, output: Output) -> bool:
        return output.name[:2] in ("q.", "v.") and output.name[2:] in self.model.layout.index

    def _sensor(self, output: Output) -> int:
        """Row of a sensor."""
        names = [name for name, _ in self.model.layout.outputs]
        if output.name not in names:
            states = [f"{x}.{name}" for name in self.model.layout.names for x in "qv"]
            raise InputError(
                f"'{output.name}' is no output of system '{self.model.system.name}'. Expected a sensor "
                f"({choices(names)}) or a state ({choices(states)})."
            )
        return names.index(output.name)

    def _check(self) -> None:
        """Names of what is differentiated by."""
        for x in self.by:
            if isinstance(x, Start) and x.state not in self.states:
                raise InputError(f"'{x.state}' is no independent state. Expected one of {choices(self.states)}.")
            if isinstance(x, Shift):
                k = self.model.input_index(x.input)
                if x.input in self.model.layout.driven:
                    raise InputError(f"input '{self.model.system.inputs[k].name}' is driven by an element.")

    def _row_at(self, time: float | None) -> int:
        """The row that ends a step at that time, ahead of a jump."""
        times = np.array(self.record.times)
        if time is None:
            return len(times) - 1
        k = int(np.argmin(np.abs(times - time)))
        if abs(times[k] - time) > 1e-9 * max(1.0, abs(time)):
            raise InputError(
                f"No step of the run ended at t = {time:.9g} s; the nearest one did at {times[k]:.9g} s. Advance the "
                "world to the times that outputs and shifts of inputs are asked for."
            )
        return k

    def _weighted(self) -> dict[int, np.ndarray]:
        """What each output takes of the value at each row: shape (n_of,) at the rows that count."""
        found: dict[int, np.ndarray] = {}

        def add(row: int, k: int, weight: float) -> None:
            found.setdefault(row, np.zeros(len(self.of)))[k] += weight

        times = np.array(self.record.times)
        for k, output in enumerate(self.of):
            if not output.integral:
                add(self._row_at(output.time), k, 1.0)
                continue
            if self._is_state(output):
                raise InputError(f"'{output.name}' is a state; expected a sensor under an integral.")
            for j, h in enumerate(np.diff(times)):
                if h > 0.0:
                    add(j, k, 0.5 * h)
                    add(j + 1, k, 0.5 * h)
        return found

    def _node(self, row: int) -> tuple[list[int], Node]:
        """Sensors that count at a row, and their derivatives there."""
        wanted = {self._sensor(o) for o, w in zip(self.of, self._weights[row], strict=True)
                  if w != 0.0 and not self._is_state(o)}  # fmt: skip
        rows = sorted(wanted)
        if not rows:
            return rows, Node(*(np.zeros((0, 0)),) * len(Node._fields))
        point = self.replay.point(row)
        return rows, node(self.model, point, np.array(rows, int), self.numbers, self.replay.directions)

    def _slopes(self, row: int) -> Node:
        """What all outputs owe to the state at a row: shapes as in Node, a row each output."""
        if row not in self._known:
            self._known[row] = self._find_slopes(row)
        return self._known[row]

    def _find_slopes(self, row: int) -> Node:
        n, w = self.model.n_q, self._weights[row]
        n_u, n_p = len(self.model.layout.input_index), len(self.numbers)
        out = Node(*(np.zeros((len(self.of), k)) for k in (0, n, n, n_u, n_p)))._replace(y=np.zeros(len(self.of)))
        rows, here = self._node(row)
        for k, output in enumerate(self.of):
            if w[k] == 0.0:
                continue
            if self._is_state(output):
                at = self.model.layout.index[output.name[2:]]
                x = self.replay.state_at(row)[0]
                (out.by_q if output.name[0] == "q" else out.by_v)[k, at] += w[k]
                out.y[k] += w[k] * x[at if output.name[0] == "q" else n + at]
                continue
            i = rows.index(self._sensor(output))
            for part, add in zip(out, here, strict=True):
                part[k] += w[k] * add[i]
        return out

    def value(self) -> np.ndarray:
        """The outputs themselves, shape (n_of,)."""
        return np.sum([self._slopes(row).y for row in self._weights], axis=0)

    def _in_force(self, row: int) -> np.ndarray:
        """Whether each shift holds over the step that begins at a row, or for sensors that are read at it."""
        t = self.record.times[row]
        return (self._begin <= t) & (t < self._end)

    def _row_shifts(self, row: int) -> np.ndarray:
        """Shifts that sensors at a row see: those of the step that ends there, or behind a jump of the next."""
        return self._in_force(row if self.record.row(row).start else row - 1)

    @property
    def _input_of(self) -> np.ndarray:
        """Index of the input of each shift, 0 for what is none."""
        return np.array([self.model.input_index(x.input) if isinstance(x, Shift) else 0 for x in self.by], int)

    @property
    def _number_of(self) -> np.ndarray:
        """Index of each declared number, -1 for what is none."""
        return np.array([self.numbers.index(x) if isinstance(x, Number) else -1 for x in self.by], int)

    def _at_start(self) -> tuple[np.ndarray, np.ndarray]:
        """dq and dv at the start by all of `by`, shape (n_by, n_q)."""
        n_x, (_, dq, dv) = len(self.states), self._start
        place = [
            self.states.index(x.state) if isinstance(x, Start) else n_x + self.numbers.index(x) if isinstance(x, Number)
            else -1 for x in self.by
        ]  # fmt: skip
        empty = np.zeros((1, self.model.n_q))
        return np.concatenate([dq, empty])[place], np.concatenate([dv, empty])[place]

    def forward(self, progress: Callable[[float], None] | None = None) -> np.ndarray:
        """Derivatives by tangents that are carried along the run, shape (n_of, n_by)."""
        columns, inputs, numbers = new_columns(self.model, len(self.by)), self._input_of, self._number_of
        c, count = columns.values, len(self.by)
        c.dq[:], c.dv[:] = self._at_start()
        c.parameter[:] = numbers
        found = self._forward_row(0, c.dq, c.dv)
        for k in range(len(self.record.times) - 1):
            if not self.record.row(k + 1).start:
                c.du[:] = 0.0
                for j in np.flatnonzero(self._in_force(k)):
                    c.du[j, 3 * inputs[j]] = c.du[count + j, 3 * inputs[j]] = 1.0
                self.replay.step(k)
                self.replay.forward(columns)
            found += self._forward_row(k + 1, c.dq, c.dv)
            if progress is not None:
                progress(self.record.times[k + 1])
        return found

    def _forward_row(self, row: int, dq: np.ndarray, dv: np.ndarray) -> np.ndarray:
        """What the sensors at a row add, shape (n_of, n_by)."""
        if row not in self._weights:
            return np.zeros((len(self.of), len(self.by)))
        return self._explicit(row) + self._slopes(row).by_q @ dq.T + self._slopes(row).by_v @ dv.T

    def _explicit(self, row: int) -> np.ndarray:
        """What the sensors at a row owe to inputs and declared numbers directly, shape (n_of, n_by)."""
        slopes, found = self._slopes(row), np.zeros((len(self.of), len(self.by)))
        now = self._row_shifts(row)
        found[:, now] += slopes.by_u[:, self._input_of[now]]
        moved = self._number_of >= 0
        found[:, moved] += slopes.by_p[:, self._number_of[moved]]
        return found

    def adjoint(self, progress: Callable[[float], None] | None = None, weights: np.ndarray | None = None) -> np.ndarray:
        """Derivatives by adjoints that are carried back from the end, shape (n_of, n_by).

        Args:
            progress: called with the time that is reached on the way back.
            weights: sums of outputs, shape (k, n_of), that are differentiated instead of each output: shape (k, n_by).
        """
        w = np.eye(len(self.of)) if weights is None else weights
        adjoints = new_adjoints(self.model, len(w), len(self.numbers))
        b, found = adjoints.values, np.zeros((len(w), len(self.by)))
        inputs, numbers = self._input_of, self._number_of
        for k in range(len(self.record.times) - 1, -1, -1):
            if k in self._weights:
                found += w @ self._explicit(k)
                b.aq[:] += w @ self._slopes(k).by_q
                b.av[:] += w @ self._slopes(k).by_v
            if k and not self.record.row(k).start:
                b.au[:] = 0.0
                self.replay.step(k - 1)
                self.replay.back(adjoints)
                now = self._in_force(k - 1)
                found[:, now] += b.au[:, 3 * inputs[now]]
            if progress is not None:
                progress(self.record.times[k])
        dq, dv = self._at_start()
        self.by_start = b.aq.copy(), b.av.copy()
        found += b.aq @ dq.T + b.av @ dv.T
        moved = numbers >= 0
        found[:, moved] += b.ap[:, numbers[moved]]
        return found


def _warn_of_contact(record: RecordedWorld) -> None:
    """Contact is differentiated as the smooth force that it is between two events; that of an event is left out."""
    names = [f"'{x.name}'" for x in record.model.system.forces if isinstance(x, Contact)]
    if names:
        warnings.warn(
            f"system '{record.model.system.name}': derivatives of a run with contact ({', '.join(names)}) hold where "
            "no contact begins or ends within a step that a change of what they are taken by would move.",
            ModelWarning,
            stacklevel=3,
        )

"""Control periods of an environment's world, each with the maps that it consists of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dms_core.errors import InputError, SimulationError, choices
from dms_core.kernels import COUNTS, DONE, MATRIX_SINGULAR, renumber
from dms_core.sensitivity.nodes import Node, Number, node
from dms_core.simulation.dynamics import RESULT_OF
from exo_env.envs.base_env import AssistanceEnv
from exo_env.gradients.kernels import PARTS, difference_part, do_part, record_steps
from exo_env.gradients.maps import Map, copied
from exo_env.gradients.moments import Moment, Moments
from exo_env.gradients.numbers import MOVED_PARTS, DeclaredNumbers, Moved
from exo_env.gradients.tangents import Tangents
from exo_env.gradients.vector import Vector
from exo_env.patient.excitation.effort import PRESENT, TICK
from exo_env.tables import STATUS
from exo_env.world.kernels.control_period import SAME_TIME, next_stop

ROWS = 64
"""Steps that are recorded before tangents are carried along them."""


class Ran(NamedTuple):
    """What a control period has come to."""

    state: np.ndarray
    """Numbers of the state at its end."""
    read: np.ndarray
    """Sensors there."""
    moment: Moment
    maps: list[Map]
    """From the numbers at its begin to those at its end; empty where it was not differentiated."""


class Periods:
    """The control periods of the present episode of an environment.

    Args:
        env: an environment that was reset.
        readings: sensors of the model, or readings of the task that copy sensors, by name.
        numbers: declared numbers that are given with each period.

    Raises:
        InputError: a name is unknown, or the drive reads more than the action and the hinge.
        gymnasium.error.ResetNeeded: the environment has no episode.
    """

    def __init__(self, env: AssistanceEnv, readings: Sequence[str], numbers: Sequence[Number]) -> None:
        self.env, self.episode, self.world = env, env.episode, env.world
        self.labels, self.rows = sensors_of(env, readings)
        self.numbers = DeclaredNumbers(self.episode, numbers)
        self.vector = Vector(self.world, len(numbers), len(self.rows))
        memory = self.vector.memory
        self._memory = np.array([(x.ctypes.data, x.size, 1) for x in memory], np.int64)
        self._kept, self._rows = np.zeros(sum(x.size for x in memory)), np.zeros((ROWS, 1 + 2 * self.world.model.n_q))
        self._tangents = Tangents(self.world, self.vector)
        self._moments = Moments(self.world, self.episode)
        self._seen: Node | None = None
        self._seen_at: Moment | None = None
        self._check_drive()

    def start(self) -> tuple[np.ndarray, Moment]:
        """Numbers of the state, and the moment, now."""
        return self._state(), self._moments.now()

    def run(self, there: Moment, state: np.ndarray, action: np.ndarray, numbers: np.ndarray, slopes: bool) -> Ran:
        """Do the control period that begins at a moment.

        Args:
            there: the moment.
            state: its state, which may have been changed, shape (n,).
            action: within -1 to 1, shape (n_a,).
            numbers: values of the declared numbers, shape (n_p,).
            slopes: whether it is differentiated.

        Raises:
            InputError: the moment is one of an episode that is over, or of its end.
            SimulationError: the solver gives up.
        """
        self._check(there)
        self._go_to(there, state)
        drive = self.world.tables.drive
        drive.before[:], drive.action[:] = drive.action, action
        do_part(self.world.packed.table, PARTS.load)
        own = [x.copy() for x in self.world.model.numbers[:MOVED_PARTS]]
        moved = self._put_numbers(numbers)
        try:
            maps = self._move(moved, slopes)
        finally:
            # What steps the environment next finds the numbers of its episode.
            self._put_own(own)
        self._seen_at = self._moments.now(there)
        return Ran(self._state(), self.world.tables.dynamics.y[self.rows].copy(), self._seen_at, maps)

    def _move(self, moved: Moved | None, slopes: bool) -> list[Map]:
        """The period under way: drive, patient and equations, from one event to the next, then what follows."""
        world, period = self.world, self.env.period
        w, status, ticks, maps = world.packed.table, world.tables.status, world.tables.patient.ticks, []
        start, end = status[STATUS.step] * period, (status[STATUS.step] + 1) * period
        if slopes:
            self._tangents.renew(moved)
            maps += [self._felt(moved), *self._drive()]
        do_part(w, PARTS.drive)
        while world.dynamics.time < end:
            if ticks[0] * TICK <= world.dynamics.time + SAME_TIME:
                if world.dynamics.time > start:
                    do_part(w, PARTS.sense)
                    self._seen = None
                    maps += [self._felt(moved)] if slopes else []
                maps += self._patient() if slopes else []
                do_part(w, PARTS.patient)
            maps += self._advance(next_stop(w), slopes)
            w = world.packed.table
        status[STATUS.code] = DONE
        do_part(w, PARTS.finish)
        self._seen = None
        return maps + [self._read(moved)] if slopes else []

    def _check_drive(self) -> None:
        """Refuse a drive that reads more than the action and the hinge's angle."""
        tables, task = self.world.tables, self.env.task
        fields = [next(k for k, x in enumerate(self.vector.memory) if x is array)
                  for array in (tables.task.readings, tables.dynamics.y, tables.drive.wanted)]  # fmt: skip
        names = [name for r in task.readings for name in [r.name] * len(r.labels)]
        read = [(fields[0], k) for k in range(len(names))]
        others = [(name, k) for name, k in self.world.names.items() if k != tables.drive.hinge[0]]
        read += [(fields[1], k) for _, k in others]
        written = [(fields[2], k) for k in range(len(tables.drive.wanted))]
        slope = np.zeros((len(written), len(read)))
        difference_part(
            self.world.packed.table, PARTS.drive, self._memory, np.array(read), np.array(written), self._kept, slope
        )  # fmt: skip
        if slope.any():
            more = dict.fromkeys([*names, *(name for name, _ in others)][k] for k in np.flatnonzero(slope.any(axis=0)))
            raise InputError(
                f"action_mode = '{self.env.action_mode}' is not differentiable here: its drive, "
                f"{type(self.env.drive).__name__}, reads {choices(more)}. Expected a drive that reads the action and "
                "the hinge's angle only."
            )

    def _check(self, there: Moment) -> None:
        if there.episode is not self.episode or self.env.episode is not self.episode:
            raise InputError(
                "The environment was reset since: expected a state of its present episode; make a new function behind "
                "each reset()."
            )

    def _go_to(self, there: Moment, state: np.ndarray) -> None:
        """Put the world to a moment, with a state that may differ from that one's."""
        self._moments.go_to(there)
        if there is not self._seen_at:
            self._seen = None
        if self.world.tables.status[STATUS.step] >= self.env.steps:
            raise InputError(f"The episode has {self.env.steps} control periods, and all of them are done.")
        if not np.array_equal(state, self._state()):
            self._put_state(state)
            self._seen = None

    def _state(self) -> np.ndarray:
        """Numbers of the present state."""
        x, at, s = np.zeros(self.vector.state), self.vector.at, self.world.dynamics.state
        x[at["q"]], x[at["v"]] = s.q, s.v
        rows = self.world.tables.patient.rows
        x[at["excitations_before"]] = s.signals.c[rows, 0]
        for name, array in self.vector.arrays.items():
            if at[name][-1] < len(x):
                x[at[name]] = array.ravel()
        # At the start of an episode no ramp has begun.
        x[at["excitations"]] = s.signals.c[rows, 0] + s.signals.c[rows, 1] * TICK
        return x

    def _put_state(self, x: np.ndarray) -> None:
        """Another state at the present time."""
        at, s, tables = self.vector.at, self.world.dynamics.state, self.world.tables
        s.q[:], s.v[:] = x[at["q"]], x[at["v"]]
        for name, array in self.vector.arrays.items():
            if at[name][-1] < len(x):
                array[...] = x[at[name]].reshape(array.shape)
        before, rows = x[at["excitations_before"]], tables.patient.rows
        s.signals.c[rows, 0], s.signals.c[rows, 1] = before, (tables.patient.excitations - before) / TICK
        s.signals.c[tables.drive.rows, 0], s.signals.c[tables.drive.rows, 1] = tables.drive.commands, 0.0
        s.counts[COUNTS.restart] = 1
        do_part(self.world.packed.table, PARTS.sense)

    def _put_numbers(self, values: np.ndarray) -> Moved | None:
        """Give declared numbers their values: what they move is added to the model's numbers."""
        if not (self.numbers.numbers or len(values)):
            return None
        load = self.world.tables.plan.loads[self.world.tables.status[STATUS.step]]
        moved = self.numbers.at(values, float(load))
        self._put_own([x + y for x, y in zip(self.world.model.numbers[:MOVED_PARTS], moved.change, strict=True)])
        return moved

    def _put_own(self, numbers: list[np.ndarray]) -> None:
        """Write numbers of the model, where they are others."""
        for into, x in zip(self.world.model.numbers[:MOVED_PARTS], numbers, strict=True):
            if (into != x).any():
                into[...] = x
                renumber(self.world.dynamics.packed.table)

    def _difference(self, part: int, written: list[np.ndarray], read: list[np.ndarray]) -> Map:
        """The map of drive or patient."""
        v, slope = self.vector, np.zeros((sum(map(len, written)), sum(map(len, read))))
        w = self.world.packed.table
        difference_part(w, part, self._memory, v.rows(read), v.rows(written), self._kept, slope)
        return Map(np.concatenate(written), np.concatenate(read), slope)

    def _drive(self) -> list[Map]:
        """From action and hinge to commands."""
        at, drive = self.vector.at, self.world.tables.drive
        hinge = at["y"][drive.hinge]
        before = copied(at["commands_before"], at["commands"])
        return [before, self._difference(PARTS.drive, [at["commands"]], [at["action"], hinge, at["commands"]])]

    def _patient(self) -> list[Map]:
        """From what the patient feels and remembers to excitations."""
        at, patient = self.vector.at, self.world.tables.patient
        newest = (int(patient.effort.present[PRESENT.newest]) + 1) % patient.effort.error.shape[1]
        read = self.vector.read_by_patient(patient.traits, newest)
        before = copied(at["excitations_before"], at["excitations"])
        return [before, self._difference(PARTS.patient, self.vector.written_by_patient(newest), read)]

    def _advance(self, stop: float, slopes: bool) -> list[Map]:
        """Step to a time; the map of all these steps."""
        world, first, helped = self.world, True, False
        while world.dynamics.time < stop:
            code, count = record_steps(world.packed.table, stop, self._rows)
            if slopes and count > 1:
                self._tangents.carry(self._rows, count, first)
                first = False
            if code == MATRIX_SINGULAR and not helped and world.dynamics.reorder():
                world.follow_dynamics()
                self._tangents.reorder()
                helped = True
            elif code != DONE:
                raise SimulationError(f"{RESULT_OF[code].value} Stopped at t = {world.dynamics.time:.6g} s.")
        return [self._tangents.map()] if slopes else []

    def _see(self, moved: Moved | None) -> Node:
        """What patient and drive feel and what is read, at the present state, found once for the end of a period."""
        if self._seen is None:
            felt = [self.world.tables.patient.senses, self.world.tables.drive.hinge]
            rows, point = np.concatenate([*felt, self.rows]), self.world.dynamics.operating_point()
            if moved is None:
                self._seen = node(self.world.model, point, rows, (), ())
            else:
                self._seen = node(moved.model, point, rows, self.numbers.numbers, moved.directions)
        return self._seen

    def _felt(self, moved: Moved | None) -> Map:
        """From coordinates and rates to what patient and drive feel of the elbow and the hinge."""
        at, n = self.vector.at, self._see(moved)
        written = np.concatenate([at["felt"], at["y"][self.world.tables.drive.hinge]])
        slope = np.hstack([n.by_q, n.by_v, n.by_p])[: len(written)]
        return Map(written, np.concatenate([at["q"], at["v"], at["numbers"]]), slope)

    def _read(self, moved: Moved | None) -> Map:
        """From the state at the end to the sensors that are read."""
        at, n = self.vector.at, self._see(moved)
        ends = self._tangents.input_slopes(n.by_u, self.world.dynamics.time)
        slope = np.hstack([n.by_q, n.by_v, ends, n.by_p])[-len(at["read"]) :]
        return Map(at["read"], np.concatenate([at["q"], at["v"], self._tangents.ends, at["numbers"]]), slope)


def sensors_of(env: AssistanceEnv, readings: Sequence[str]) -> tuple[list[str], np.ndarray]:
    """Names of all components of some readings, and their rows among the model's sensors.

    Raises:
        InputError: a reading is no sensor.
    """
    copies = {r.name: r.sensors for r in env.task.readings if r.sensors}
    labels: list[str] = []
    for name in readings:
        if name not in copies and name not in env.world.names:
            raise InputError(
                f"reading '{name}' is no sensor of the model and no copy of one. Expected some of {choices(copies)}, "
                f"or of the sensors {choices(env.world.names)}."
            )
        labels += copies.get(name, (name,))
    if not labels:
        raise InputError("readings = []: Expected at least one name.")
    return labels, np.array([env.world.names[x] for x in labels])

"""Kinematic simulation: drivers move every freedom, and the motion follows from phi alone (paper Fig. 1).

    phi(q, t) = 0,    phi_q v = -phi_t,    phi_q vdot = -(phi_q v)_q v - phi_tt,    phi_q^T lam = f - M vdot

At each time Newton's method closes the constraints from the position predicted by v and vdot; where the prediction
errs too much the interval is halved. Where phi_q loses rank the position is singular: the motion goes on along its
branch and the place is reported, or ends there, where velocities grow without bound (a rocker at the end of its swing).

Turn counters go along with the joints that they count (driven_states.py). Other states of elements (fibres,
activations, controllers) do not follow from positions; they stay at their start.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dms_core.analyses.driven_states import TurnCounts, check_drives_nothing
from dms_core.analyses.motion_names import motion_in_words
from dms_core.assembly.derivatives.blocks import OperatingPoint
from dms_core.assembly.model import Model
from dms_core.assembly.residual import evaluate_inputs
from dms_core.compiled.arena import Packed
from dms_core.errors import InputError, ModelError, SimulationError, choices
from dms_core.files.memory import check_memory
from dms_core.flags import Flag, Limits, input_values
from dms_core.linear.rank import independent_rows
from dms_core.model.system import System
from dms_core.results import States

CLOSED, ITERATIONS = 1e-13, 10
"""Constraint error of a position [m or -], and Newton steps to get there."""
ROUNDED = 1e-10
"""Constraint error that is left where rounding lets Newton's method get no further."""
FARTHEST = 0.05
"""Largest error of a prediction over the nominal sizes; beyond it the interval is halved."""
MOST_HALVINGS = 30
"""Of one interval, before the position counts as singular."""
SINGULAR = 1e-7
"""Smallest singular value over the largest, of rows scaled to 1, below which a position is singular."""


@dataclass(frozen=True)
class SingularPosition:
    """A position where drivers and joints determine no velocity."""

    t: float
    """[s]"""
    words: str
    """What could move there with all drivers at rest."""

    @property
    def sentence(self) -> str:
        """For the user."""
        return f"singular position at t = {self.t:.8g} s: with all drivers at rest {self.words}."


@dataclass(frozen=True)
class KinematicResult:
    """A driven motion."""

    states: States
    singular: tuple[SingularPosition, ...]
    """Singular positions that the motion went through."""
    iterations: int
    substeps: int
    """Positions between those that were asked for."""
    failure: str = ""
    """Why the motion ends before the last time; empty where it does not."""

    def check(self) -> KinematicResult:
        """This result.

        Raises:
            SimulationError: the mechanism could not follow its drivers to the end.
        """
        if self.failure:
            raise SimulationError(self.failure)
        return self

    @property
    def t(self) -> np.ndarray:
        """Times [s], shape (n,)."""
        return self.states.t

    @property
    def flags(self) -> tuple[Flag, ...]:
        """Elements that left the range they are meant for, as a rope that pushes, see `Trajectory.flags`."""
        s = self.states
        return Limits(s.model).left(s.t, s.q, s.lam, input_values(s.model, s.signals, s.t, s.v, s.behind))

    def sensors(self) -> dict[str, np.ndarray]:
        """Every component of every sensor by name, shape (n,) each."""
        return self.states.sensors()


class Driven:
    """The kinematics of one driven model.

    Args:
        model: a compiled model.

    Raises:
        ModelError: a freedom has no driver, two drivers determine the same one, or an element drives an input.
    """

    def __init__(self, model: Model) -> None:
        check_drives_nothing(model)
        self.model = model
        self.moving = np.arange(model.layout.of_bodies)
        self.scale = model.tables.values.scale_q
        self.turns = TurnCounts(model)
        self._signals, self._work = Packed(model.new_signals()), Packed(model.new_work())
        _check_drivers(model, self.moving)

    def inputs(self, t: float) -> np.ndarray:
        """Value and derivatives of all inputs, from the left of a jump, shape (n_u, 3)."""
        evaluate_inputs(self._signals.table, t, t > 0.0, self._work.table)
        return self._work.values.u.copy()

    def closed(self, q: np.ndarray, t: float) -> tuple[np.ndarray, int] | None:
        """The position near q at time t, and Newton steps; None where they do not converge."""
        q, before = q.copy(), np.inf
        for k in range(ITERATIONS):
            phi, _, G, _ = self.model.constraint_jacobian(q, None, t, t > 0.0)
            size = float(np.abs(phi).max(initial=0.0))
            if size < CLOSED or (size < ROUNDED and size >= before):
                self.turns.put_angles(q)
                return q, k
            if not size < 1e3:
                return None
            q[self.moving] -= np.linalg.lstsq(G[:, self.moving], phi, rcond=1e-12)[0]
            before = size
        return None

    def motion(self, q: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        """v and vdot at a position."""
        model, zero = self.model, np.zeros(self.model.n_q)
        v, a = zero.copy(), zero.copy()
        _, phi_t, G, _ = model.constraint_jacobian(q, zero, t, t > 0.0)
        G = G[:, self.moving]
        v[self.moving] = np.linalg.lstsq(G, -phi_t, rcond=1e-12)[0]
        self.turns.put_rates(q, v)
        u = self.inputs(t)
        point = OperatingPoint(q, v, v, zero, np.zeros(model.n_phi), np.zeros(model.n_phi), u)
        b = model.derivatives.blocks(point)
        phi_tt = np.einsum("ij,j->i", b.r4_u[:, :, 1], u[:, 2]) + np.einsum("ij,j->i", b.r4_u[:, :, 0], u[:, 1])
        a[self.moving] = np.linalg.lstsq(G, -(b.r4_q @ v + phi_tt), rcond=1e-12)[0]
        return v, a

    def multipliers(self, q: np.ndarray, v: np.ndarray, a: np.ndarray, t: float) -> np.ndarray:
        """Multipliers of least norm that make the motion, from the rows of the bodies."""
        model, none = self.model, np.zeros(self.model.n_phi)
        b = model.derivatives.blocks(OperatingPoint(q, v, v, a, none, none, self.inputs(t)))
        return np.linalg.lstsq(b.phi_q.toarray()[:, self.moving].T, -b.r2[self.moving], rcond=1e-12)[0]

    def smallest(self, q: np.ndarray, t: float) -> tuple[float, np.ndarray]:
        """Smallest singular value of phi_q over the largest, rows scaled to 1, and the motion that belongs to it."""
        G = self.model.constraint_jacobian(q, None, t, t > 0.0)[2][:, self.moving]
        length = np.linalg.norm(G, axis=1)
        _, values, motions = np.linalg.svd(G / np.where(length > 0.0, length, 1.0)[:, None])
        dq = np.zeros(self.model.n_q)
        dq[self.moving] = motions[-1]
        return (float(values[-1] / values[0]) if len(values) >= len(self.moving) else 0.0), dq


def kinematic(
    model: Model | System, times: np.ndarray, progress: Callable[[float], None] | None = None
) -> KinematicResult:
    """The motion that the drivers prescribe.

    Args:
        model: a compiled Model, or a System to compile; every freedom of its bodies has a driver.
        times: rising, from 0 on [s], shape (n,).
        progress: called with the time reached.

    Returns:
        The motion, up to a singular position that it cannot leave if there is one (`failure` names it).

    Raises:
        InputError: times do not rise, begin before 0, or are more than memory holds the motion of.
        ModelError: a driver is missing, or two drive the same coordinate; names the motion or the drivers. An element
            drives an input, which would be 0; names both.

    Example:
        >>> result = kinematic(model, np.linspace(0.0, 2.0, 201)).check()
        >>> result.sensors()["rocker_angle.acceleration"], result.singular
    """
    compiled = model if isinstance(model, Model) else Model(model)
    times = np.atleast_1d(np.asarray(times, float))
    if not len(times) or not np.isfinite(times).all() or times[0] < 0.0 or np.any(np.diff(times) <= 0.0):
        raise InputError("times: Expected finite, rising times from 0 s on.")
    check_memory("times", len(times), 3 * compiled.n_q + 2 * compiled.n_phi)
    driven = Driven(compiled)
    walk, failure = _Walk(driven), ""
    rows = []
    for t in times:
        try:
            walk.to(float(t))
        except SimulationError as error:
            failure = str(error)
            break
        lam = driven.multipliers(walk.q, walk.v, walk.a, walk.t)
        rows.append((walk.q, walk.v, walk.a, lam))
        if progress is not None:
            progress(float(t))
    if not rows:
        raise SimulationError(failure)
    q, v, a, lam = (np.array(part) for part in zip(*rows, strict=True))
    done = times[: len(rows)]
    states = States(compiled, compiled.new_signals(), done, q, v, a, lam, np.zeros_like(lam), done == 0.0)
    return KinematicResult(states, tuple(walk.singular), walk.iterations, walk.substeps, failure)


class _Walk:
    """A driven model on its way in time."""

    def __init__(self, driven: Driven) -> None:
        self._driven, self.t = driven, 0.0
        self.q = driven.model.start.q
        self.v, self.a = driven.motion(self.q, 0.0)
        self.singular: list[SingularPosition] = []
        self.iterations = self.substeps = 0
        self._rows = self._independent()
        self._sign = self._orientation()

    def to(self, end: float) -> None:
        """On to a time, in intervals as short as it takes.

        Raises:
            SimulationError: the mechanism cannot follow.
        """
        length = end - self.t
        while end - self.t > 1e-14 * max(1.0, end):
            length = min(length, end - self.t)
            whole = length == end - self.t
            t = end if whole else self.t + length
            found = self._at(t)
            if found is None:
                length *= 0.5
                if length < (end + 1e-3) * 0.5**MOST_HALVINGS:
                    raise SimulationError(self._stuck())
                continue
            if not whole:
                self.substeps += 1
            before, q_before = self.t, self.q
            self.q, self.t = found, t
            self.v, self.a = self._driven.motion(self.q, t)
            self._watch(before, q_before)
            length *= 2.0

    def _at(self, t: float) -> np.ndarray | None:
        """The position at t, where the prediction is good."""
        h = t - self.t
        guess = self.q + h * (self.v + 0.5 * h * self.a)
        done = self._driven.closed(guess, t)
        if done is None:
            return None
        q, iterations = done
        self.iterations += iterations
        moved = np.abs(q - guess)[self._driven.moving] / self._driven.scale[self._driven.moving]
        return q if np.max(moved, initial=0.0) <= FARTHEST else None

    def _independent(self) -> np.ndarray:
        """Rows that determine the position here."""
        G = self._driven.model.constraint_jacobian(self.q, None, self.t, self.t > 0.0)[2][:, self._driven.moving]
        return independent_rows(G).independent

    def _orientation(self, q: np.ndarray | None = None, t: float | None = None) -> float:
        """Sign of the determinant of these rows: it changes where they are dependent."""
        q, t = (self.q, self.t) if q is None or t is None else (q, t)
        G = self._driven.model.constraint_jacobian(q, None, t, t > 0.0)[2]
        rows = G[np.ix_(self._rows, self._driven.moving)]
        return float(np.linalg.slogdet(rows)[0]) if rows.shape[0] == rows.shape[1] else 0.0

    def _watch(self, before: float, q_before: np.ndarray) -> None:
        """Report a singular position between the last place and this one; choose other rows where it was theirs."""
        sign = self._orientation()
        if sign == self._sign and sign != 0.0:
            return
        t, q = self._locate(before, q_before)
        size, motion = self._driven.smallest(q, t)
        if size < SINGULAR * 10.0:
            self.singular.append(SingularPosition(t, motion_in_words(self._driven.model, q, motion)))
        if self._driven.smallest(self.q, self.t)[0] > SINGULAR:
            self._rows = self._independent()
            self._sign = self._orientation()
        else:
            self._sign = 0.0

    def _locate(self, low: float, q_low: np.ndarray) -> tuple[float, np.ndarray]:
        """Time and position where the determinant changes its sign, by bisection from the last place."""
        high, q_high, sign = self.t, self.q, self._sign
        if sign == 0.0:
            return low, q_low
        while high - low > 1e-12 * max(1.0, high):
            t = 0.5 * (low + high)
            done = self._driven.closed(0.5 * (q_low + q_high), t)
            if done is None:
                break
            if self._orientation(done[0], t) == sign:
                low, q_low = t, done[0]
            else:
                high, q_high = t, done[0]
        return high, q_high

    def _stuck(self) -> str:
        """Why the motion ends here."""
        driven = self._driven
        _, motion = driven.smallest(self.q, self.t)
        model = driven.model
        return (
            f"the drivers ask for a position that the mechanism cannot reach beyond t = {self.t:.8g} s: it is in a "
            f"singular position, where with all drivers at rest {motion_in_words(model, self.q, motion)}. Let the "
            "drivers stay within what the links allow, or drive another joint."
        )


def _check_drivers(model: Model, moving: np.ndarray) -> None:
    """Refuse a model with a freedom that no driver moves, or with drivers that move the same one.

    Raises:
        ModelError: names the motion, or the drivers.
    """
    calls = [c for c in model.layout.constraints if len(c.iu)]
    driving = np.zeros(model.n_phi, bool)
    for c in calls:
        driving[c.row : c.row + c.rows] = True
    G = model.constraint_jacobian(model.start.q)[2][:, moving]
    rank = len(independent_rows(G).independent)
    joints = len(independent_rows(G[~driving]).independent)
    names = {c.element.name: slice(c.row, c.row + c.rows) for c in calls}
    if rank - joints < np.count_nonzero(driving):
        twice = [
            name for name, rows in names.items()
            if len(independent_rows(np.delete(G, np.r_[rows], axis=0)).independent) == rank
        ]  # fmt: skip
        raise ModelError(
            f"system '{model.system.name}': the drivers {', '.join(repr(n) for n in twice)} move the same coordinate; "
            "expected one driver for each freedom. Remove one of them."
        )
    if rank < len(moving):
        motions = np.linalg.svd(G)[2][rank:]
        words = []
        for motion in motions[:3]:
            dq = np.zeros(model.n_q)
            dq[moving] = motion
            words.append(motion_in_words(model, model.start.q, dq))
        missing = len(moving) - rank
        have = f" Drivers: {choices(names)}." if names else " There is none."
        raise ModelError(
            f"system '{model.system.name}': {missing} {'driver is' if missing == 1 else 'drivers are'} missing: "
            f"nothing determines that {'; or that '.join(words)}. A kinematic simulation needs an angle_driver or a "
            f"position_driver for each freedom.{have}"
        )


def driver_loads(model: Model, states: States) -> dict[str, np.ndarray]:
    """What each driver gives: moment [Nm] or force [N] in the sense of its growing input, shape (n,) each."""
    return {name: -states.lam[:, row] for name, row in driver_rows(model).items()}


def driver_rows(model: Model) -> dict[str, int]:
    """Constraint row of each driver, by its name; by the row's where a driver has several."""
    names = model.layout.row_names
    return {
        c.element.name if c.rows == 1 else names[row]: row
        for c in model.layout.constraints if len(c.iu)
        for row in range(c.row, c.row + c.rows)
    }  # fmt: skip

"""Paths of equilibria over a load factor, through limit points, by arc length (Riks 1979; Crisfield 1981).

Along the path, with dq = N dz + p ds (N the null space of phi_q, phi_q p = -phi_s),

    [ N^T K N   N^T (f_s + K p) ]
    [        t^T (metric)       ]  (dz, ds) = (-N^T r, arc length)

the matrix stays regular at a limit point, where N^T K N is singular: there the load turns round and the system snaps
through. Where the bordered matrix itself is singular another branch crosses (a bifurcation, as of a buckling column).
Both are found by their signs, of ds/darc and of the determinant, and located by Brent's method along the last step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq

from dms_core.analyses.independent import basis
from dms_core.analyses.motion_names import motion_in_words
from dms_core.analyses.rest_equations import RestBlocks, RestEquations
from dms_core.analyses.static import Equilibrium, balanced, equilibrium_at, relaxed, states_at_rest, stiffnesses
from dms_core.assembly.model import Model
from dms_core.errors import InputError
from dms_core.model.system import System
from dms_core.results import States

CONVERGED, ITERATIONS = 1e-11, 12
"""Last correction over the nominal sizes, and corrections a point."""
FEWEST = 1e-7
"""Shortest step over the largest one."""
STRAIGHT = 0.9
"""Least cosine between two tangents: at a sharper turn the step is halved."""
LOCATED = 1e-10
"""Share of a step to which a limit point or a bifurcation is located."""


@dataclass(frozen=True)
class Event:
    """A point where the path turns in load, or where another one crosses it."""

    kind: Literal["limit point", "bifurcation"]
    equilibrium: Equilibrium
    words: str
    """The motion that has no stiffness there."""

    @property
    def load(self) -> float:
        """Load factor."""
        return self.equilibrium.load

    @property
    def sentence(self) -> str:
        """For the user."""
        return f"{self.kind} at load factor {self.load:.8g}: without stiffness, {self.words}."


@dataclass(frozen=True)
class EquilibriumPath:
    """Equilibria in the order of the path, and what happens on it."""

    points: tuple[Equilibrium, ...]
    events: tuple[Event, ...]
    reached: bool
    """True where the path got to the load factor that was asked for."""

    @property
    def loads(self) -> np.ndarray:
        """Load factors, shape (k,)."""
        return np.array([e.load for e in self.points])

    @property
    def stable(self) -> np.ndarray:
        """True where no small disturbance grows, shape (k,)."""
        return np.array([e.stable for e in self.points])

    @property
    def limit_points(self) -> tuple[Event, ...]:
        """Where the load turns round."""
        return tuple(e for e in self.events if e.kind == "limit point")

    def states(self) -> States:
        """The equilibria as states, whose sensors can be read."""
        return states_at_rest(self.points)


class _Place(NamedTuple):
    """A point of the path."""

    q: np.ndarray
    lam: np.ndarray
    s: float
    b: RestBlocks
    N: np.ndarray
    p: np.ndarray
    """dq by ds that keeps the constraints, shape (n_q,)."""
    tq: np.ndarray
    """Tangent: dq and ds by arc length."""
    ts: float
    determinant: float
    """Of the bordered matrix, its n-th root with sign; K is scaled to 1."""


class _Follower:
    """Steps along the path of one set of equations."""

    def __init__(self, equations: RestEquations) -> None:
        self.equations = equations
        self.scale = equations.model.tables.values.scale_q

    def first(self, q: np.ndarray, load: float, to: float) -> _Place:
        """The place where a path begins, with its tangent towards the load factor `to`."""
        here = self.place(q, load, None)
        if here.ts * np.sign(to - load) < 0.0:
            return here._replace(tq=-here.tq, ts=-here.ts, determinant=-here.determinant)
        return here

    def next(self, here: _Place, length: float, to: float, upwards: float) -> tuple[_Place, bool] | None:
        """The next place, and whether it is the last one, at the load `to`; None where the step was too long."""
        there = self.step(here, length)
        if there is None or self._along(here, there.tq, there.ts) < STRAIGHT:
            return None
        if (there.s - to) * upwards < 0.0:
            return there, False
        last = self.step(here, length * (to - here.s) / (there.s - here.s), to)
        return None if last is None else (last, True)

    def place(self, q: np.ndarray, s: float, before: _Place | None) -> _Place:
        """A converged position with its tangent, in the direction of the place before."""
        lam, b = balanced(self.equations, q, np.zeros(self.equations.model.n_phi), s)
        N, p = basis(self.equations.model, b.G), _shift(b)
        rows = _bordered(b, N, p) / (np.abs(b.K).max(initial=0.0) or 1.0)
        if before is None:
            tangent = np.linalg.svd(rows)[2][-1]
        else:
            # Where two branches cross this is the direction nearest to the one before.
            matrix = np.vstack([rows, self._border(before.tq, before.ts, N, p)])
            tangent = np.linalg.lstsq(matrix, np.eye(len(matrix))[-1], rcond=1e-12)[0]
        tq, ts = N @ tangent[:-1] + p * tangent[-1], float(tangent[-1])
        length = np.sqrt(np.sum((tq / self.scale) ** 2) + ts**2)
        sign = self._along(before, tq, ts) if before is not None else (ts or 1.0)
        factor = np.copysign(1.0 / length, sign)
        tq, ts = factor * tq, factor * ts
        border = np.vstack([rows, self._border(tq, ts, N, p)])
        sign, size = np.linalg.slogdet(border)
        return _Place(q, lam, s, b, N, p, tq, ts, float(sign * np.exp(size / len(border))))

    def _along(self, at: _Place, tq: np.ndarray, ts: float) -> float:
        """Cosine, for unit tangents, between a direction and that of a place."""
        return float(np.sum(at.tq * tq / self.scale**2) + at.ts * ts)

    def _border(self, tq: np.ndarray, ts: float, N: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Arc length of (dz, ds)."""
        weighted = tq / self.scale**2
        return np.concatenate([weighted @ N, [weighted @ p + ts]])

    def step(self, at: _Place, length: float, load: float | None = None) -> _Place | None:
        """The place one arc length on, or the nearest one with that load; None where Newton's method fails."""
        model = self.equations.model
        q, s = at.q + length * at.tq, at.s + length * at.ts
        if load is not None:
            s = load
        lam = at.lam
        for _ in range(ITERATIONS):
            lam, b = balanced(self.equations, q, lam, s)
            if not (np.isfinite(b.f).all() and np.isfinite(b.K).all()):
                return None
            N, p = basis(model, b.G), _shift(b)
            close = -np.linalg.lstsq(b.G, b.phi, rcond=1e-12)[0] if len(b.phi) else np.zeros(model.n_q)
            rows = _bordered(b, N, p)
            gone = np.sum(at.tq * (q + close - at.q) / self.scale**2) + at.ts * (s - at.s)
            border = self._border(at.tq, at.ts, N, p) if load is None else np.eye(len(rows) + 1)[-1]
            right = np.append(-(N.T @ (b.f + b.K @ close)), length - gone if load is None else load - s)
            sizes = np.append(_row_sizes(b, N), 1.0)
            matrix = np.vstack([rows, border]) / sizes[:, None]
            change = np.linalg.lstsq(matrix, right / sizes, rcond=1e-13)[0]
            dq = close + N @ change[:-1] + p * change[-1]
            q, s = q + dq, s + change[-1]
            size = max(float(np.max(np.abs(dq) / self.scale)), abs(float(change[-1])))
            if not size < 1e3:
                return None
            if size < CONVERGED:
                return self.place(q, s, at)
        return None


def _bordered(b: RestBlocks, N: np.ndarray, p: np.ndarray) -> np.ndarray:
    """[N^T K N, N^T (f_s + K p)], the rows of equilibrium by (dz, ds), shape (k, k + 1)."""
    return np.concatenate([N.T @ b.K @ N, (N.T @ (b.f_s + b.K @ p))[:, None]], axis=1)


def _row_sizes(b: RestBlocks, N: np.ndarray) -> np.ndarray:
    """Sizes of what adds up to each row of N^T K N, which may cancel there, shape (k,)."""
    parts = np.abs(N.T) @ np.abs(b.K) @ np.abs(N)
    sizes = np.max(parts, axis=1, initial=0.0)
    return np.where(sizes > 0.0, sizes, 1.0)


def _shift(b: RestBlocks) -> np.ndarray:
    """p with phi_q p = -phi_s."""
    if not b.phi_s.any():
        return np.zeros(len(b.f))
    return -np.linalg.lstsq(b.G, b.phi_s, rcond=1e-12)[0]


def follow_path(
    model: Model | System,
    loads: Sequence[str],
    *,
    to: float = 1.0,
    load: float = 0.0,
    longest: float = 0.05,
    max_points: int = 1000,
    time: float = 0.0,
    inputs: dict[str, float] | None = None,
    start: np.ndarray | None = None,
    progress: Callable[[float], None] | None = None,
) -> EquilibriumPath:
    """Equilibria from one load factor to another, through limit points.

    Args:
        model: a compiled Model, or a System to compile.
        loads: names of force elements and inputs that the load factor multiplies.
        to: load factor at which the path ends, where it gets there.
        load: load factor at which it begins.
        longest: largest arc length between two points; coordinates count over their nominal sizes, the load as it is.
        max_points: at which an unfinished path ends.
        time: at which the declared inputs are taken [s].
        inputs: values in place of the declared ones, by name.
        start: position to look for the first equilibrium from, shape (n_q,); default: the assembled start.
        progress: called with the load factor reached.

    Raises:
        InputError: no load is named, one does not exist, or a number is out of range.
        SimulationError: there is no equilibrium to begin with.

    Example:
        >>> path = follow_path(truss, ["push"], to=2.0)
        >>> [event.load for event in path.limit_points]
    """
    _check_range(loads, load, to, longest)
    compiled = model if isinstance(model, Model) else Model(model)
    equations = RestEquations(compiled, loads, time, inputs)
    q, _, iterations = relaxed(equations, equations.unknowns(compiled.start.q if start is None else start), load)
    follower = _Follower(equations)
    here = follower.first(q, load, to)
    points, events = [equilibrium_at(equations, here.q, here.lam, here.s, iterations)], list[Event]()
    length, reached = longest, False
    while len(points) < max_points and not reached:
        found = follower.next(here, length, to, np.sign(to - load))
        if found is None:
            length *= 0.5
            if length < FEWEST * longest:
                break
            continue
        there, reached = found
        events += _events(follower, here, there, length)
        points.append(equilibrium_at(equations, there.q, there.lam, there.s, 0))
        here, length = there, min(1.5 * length, longest)
        if progress is not None:
            progress(here.s)
    return EquilibriumPath(tuple(points), tuple(events), reached)


def _check_range(loads: Sequence[str], load: float, to: float, longest: float) -> None:
    """Whether there is a path to follow.

    Raises:
        InputError: there is none.
    """
    if not loads:
        raise InputError("loads: Expected the names of the loads that grow along the path, got none.")
    if to == load or not np.isfinite([to, load]).all():
        raise InputError(f"to: Expected a finite load factor other than the first, {load}, got {to}.")
    if not longest > 0.0:
        raise InputError(f"longest: Expected a positive arc length, got {longest}.")


def _events(follower: _Follower, here: _Place, there: _Place, length: float) -> list[Event]:
    """What lies between two neighbouring places."""
    found = []
    kinds: tuple[tuple[Literal["limit point", "bifurcation"], Callable[[_Place], float]], ...] = (
        ("limit point", lambda x: x.ts),
        ("bifurcation", lambda x: x.determinant),
    )
    for kind, number in kinds:
        if number(there) != 0.0 and number(here) * number(there) >= 0.0:
            continue
        place = there if number(there) == 0.0 else _located(follower, here, length, number)
        if place is not None:
            equations = follower.equations
            motion = stiffnesses(place.b, place.N)[1][:, -1]
            equilibrium = equilibrium_at(equations, place.q, place.lam, place.s, 0)
            found.append(Event(kind, equilibrium, motion_in_words(equations.model, place.q, motion)))
    return found


def _located(follower: _Follower, here: _Place, length: float, number: Callable[[_Place], float]) -> _Place | None:
    """The place between 0 and length where a number changes its sign; None where it cannot be told."""
    known = {0.0: here}

    def at(share: float) -> float:
        if share not in known:
            place = follower.step(here, share * length)
            # On a bifurcation itself Newton's matrix is singular: near it is near enough.
            if place is None:
                return 0.0
            known[share] = place
        return number(known[share])

    try:
        brentq(at, 0.0, 1.0, xtol=LOCATED)
    except ValueError:
        return None
    before, behind = _neighbours(known, number)
    part = number(before) / (number(before) - number(behind))
    return before._replace(
        q=before.q + part * (behind.q - before.q),
        lam=before.lam + part * (behind.lam - before.lam),
        s=before.s + part * (behind.s - before.s),
    )


def _neighbours(known: dict[float, _Place], number: Callable[[_Place], float]) -> tuple[_Place, _Place]:
    """The last place with the sign of the first one, and the first behind it."""
    shares = sorted(known)
    first = np.sign(number(known[shares[0]]))
    k = next(k for k, share in enumerate(shares) if np.sign(number(known[share])) != first)
    return known[shares[k - 1]], known[shares[k]]

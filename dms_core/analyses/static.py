"""Static equilibrium: v = 0, vdot = 0, phi_q^T lam = f(q, 0, u), phi = 0 (paper Fig. 1).

Newton's method on the equations of rest, damped until it is near: each iteration is a step of the implicit Euler method
from rest,

    (M / h^2 + C / h + K) dq + phi_q^T lam = f,     phi_q dq = -phi            (C / h alone for states of first order)

whose pseudo-time h grows as the equilibrium comes near; for h to infinity it is Newton's step, and converges
quadratically (pseudo-transient continuation, Kelley and Keyes 1998). All speed is taken out after each step, so that
the system creeps to where it would come to rest, and does not end on an unstable equilibrium that happens to be near. A
line search shortens a step over which the force turns round, |work behind it| <= 0.9 |work before it|, or that moves a
part too far. Loads may be put on in steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dms_core.analyses.independent import basis
from dms_core.analyses.linearise import Linearisation, linearise
from dms_core.analyses.motion_names import motion_in_words
from dms_core.analyses.rest_equations import RestBlocks, RestEquations
from dms_core.assembly.derivatives.blocks import OperatingPoint
from dms_core.assembly.model import Model
from dms_core.errors import InputError, SimulationError
from dms_core.flags import Flag, Limits
from dms_core.model.system import System
from dms_core.results import States

FIRST_TIME, LARGEST_TIME, SMALLEST_TIME = 0.05, 1e9, 1e-7
"""Pseudo-time of the first step, from which on a step is Newton's own, and below which nothing moves [s]."""
LONGEST = 0.3
"""Longest change of a coordinate in one step, over its nominal size."""
NEAR, CONVERGED = 1e-6, 1e-10
"""Step over the nominal sizes from which on steps are Newton's own, and that of the last one: the next is rounding."""
MAX_ITERATIONS = 300
CLOSED, MAX_CLOSING = 1e-12, 12
"""Constraint error after a step [m or -], and iterations to get there."""
LEFT, ROUNDING = 1e-8, 1e-14
"""Force along a free motion over the forces that cancel, up to which it is balanced, and rounding of a position."""
SOFT = 1e-9
"""Stiffness of the softest motion over that of the stiffest, below which it is free."""
TURNED = 0.9
"""Share of a step's work that a force which has turned round may do behind it."""


@dataclass(frozen=True)
class Equilibrium:
    """A state of rest."""

    model: Model
    equations: RestEquations
    load: float
    """Load factor; 1 with all loads."""
    point: OperatingPoint
    """The state of rest: multipliers are those of least norm, rates are 0 but where they are signals."""
    iterations: int
    linearisation: Linearisation

    @property
    def q(self) -> np.ndarray:
        """Coordinates, shape (n_q,)."""
        return self.point.q

    @property
    def lam(self) -> np.ndarray:
        """Multipliers of least norm, shape (n_phi,)."""
        return self.point.lam

    @property
    def growth(self) -> float:
        """Largest real part of an eigenvalue [1/s]."""
        return self.linearisation.growth

    @property
    def stable(self) -> bool:
        """True where no small disturbance grows; one that an undamped system swings about counts as stable."""
        return self.linearisation.stable

    @property
    def flags(self) -> tuple[Flag, ...]:
        """Elements that rest outside the range they are meant for, as a rope that pushes."""
        u = self.point.u[None, :, 0]
        return Limits(self.model).left(np.zeros(1), self.q[None], self.lam[None], u)

    @property
    def sentence(self) -> str:
        """Stable or not, and how fast what is unstable leaves."""
        if self.stable:
            return "The equilibrium is stable."
        return f"The equilibrium is unstable: a small disturbance grows e-fold in {1.0 / self.growth:.4g} s."


@dataclass(frozen=True)
class StaticResult:
    """The equilibria under growing load; the last one is under the whole load."""

    steps: tuple[Equilibrium, ...]

    @property
    def last(self) -> Equilibrium:
        """The equilibrium under the whole load."""
        return self.steps[-1]

    @property
    def loads(self) -> np.ndarray:
        """Load factors, shape (k,)."""
        return np.array([e.load for e in self.steps])

    def states(self) -> States:
        """The equilibria as states, whose sensors can be read; times are 0."""
        return states_at_rest(self.steps)


def states_at_rest(found: Sequence[Equilibrium]) -> States:
    """Equilibria of one model as states, with the inputs that each has."""
    model, inputs = found[0].model, [e.point.u for e in found]
    q, lam = np.array([e.q for e in found]), np.array([e.lam for e in found])
    v = np.array([e.point.v for e in found])
    return RestStates(model, inputs, q, v, lam)


class RestStates(States):
    """States of rest, each with its own inputs."""

    def __init__(
        self, model: Model, inputs: Sequence[np.ndarray], q: np.ndarray, v: np.ndarray, lam: np.ndarray
    ) -> None:
        zero = np.zeros_like(q)
        super().__init__(model, model.new_signals(), np.zeros(len(q)), q, v, zero, lam, np.zeros_like(lam))
        self._inputs = inputs

    def sensors(self) -> dict[str, np.ndarray]:
        """Every component of every sensor by name, shape (k,) each."""
        derivatives, rows = self.model.derivatives, []
        for k in range(len(self.t)):
            point = OperatingPoint(self.q[k], self.v[k], self.v[k], self.a[k], self.lam[k], self.mu[k], self._inputs[k])
            rows.append(derivatives.sensor_blocks(point).y)
        y = np.array(rows)
        return {name: y[:, k] for k, (name, _) in enumerate(self.model.layout.outputs)}


def static_equilibrium(
    model: Model | System,
    *,
    loads: Sequence[str] = (),
    steps: int = 1,
    time: float = 0.0,
    inputs: dict[str, float] | None = None,
    start: np.ndarray | None = None,
    progress: Callable[[float], None] | None = None,
) -> StaticResult:
    """The equilibrium that the system creeps to from its assembled start.

    Args:
        model: a compiled Model, or a System to compile.
        loads: names of force elements and inputs that are put on in steps; needed for `steps` above 1 only.
        steps: number of equal load steps, each started where the last one ended.
        time: at which the declared inputs are taken [s].
        inputs: values in place of the declared ones, by name.
        start: position to start from, shape (n_q,); default: the assembled start.
        progress: called with the load factor reached.

    Raises:
        InputError: a load or an input does not exist, or steps is no positive whole number.
        SimulationError: there is no equilibrium, or it is not unique; the free motion is named.

    Example:
        >>> result = static_equilibrium(system, loads=["weight"], steps=4)
        >>> result.last.stable, result.states().sensors()["swing.angle"][-1]
    """
    if steps < 1 or int(steps) != steps:
        raise InputError(f"steps: Expected a positive whole number of load steps, got {steps}.")
    if steps > 1 and not loads:
        raise InputError("loads: Expected the names of the loads that are put on in steps, got none.")
    compiled = model if isinstance(model, Model) else Model(model)
    equations = RestEquations(compiled, loads, time, inputs)
    q = equations.unknowns(compiled.start.q if start is None else start)
    found = []
    for k in range(int(steps)):
        s = (k + 1.0) / steps
        q, lam, iterations = relaxed(equations, q, s)
        found.append(equilibrium_at(equations, q, lam, s, iterations))
        if progress is not None:
            progress(s)
    return StaticResult(tuple(found))


def equilibrium_at(equations: RestEquations, q: np.ndarray, lam: np.ndarray, s: float, iterations: int) -> Equilibrium:
    """A position of rest with its multipliers as an Equilibrium, linearised there."""
    point = equations.point(q, lam, s)
    linear = linearise(equations.model, point, held=np.flatnonzero(equations.held), blocks=equations.blocks(point, s))
    linear = linear.without([*equations.signals, *equations.constant])
    return Equilibrium(equations.model, equations, s, point, iterations, linear)


def relaxed(equations: RestEquations, q: np.ndarray, s: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Position of rest, multipliers and number of iterations, creeping from q under load factor s.

    Raises:
        SimulationError: see `static_equilibrium`.
    """
    model = equations.model
    scale = model.tables.values.scale_q
    h, change = FIRST_TIME, np.zeros(model.n_q)
    q = closed(equations, q, s)
    lam, b = balanced(equations, q, np.zeros(model.n_phi), s)
    at_start = float(np.abs(b.f).max(initial=0.0))
    for iteration in range(1, MAX_ITERATIONS + 1):
        N = basis(model, b.G)
        change = _step(model, b, N, h)
        trial = closed(equations, q + change, s) if _short(model, change, scale) else None
        if trial is not None:
            lam_trial, b_trial = balanced(equations, trial, lam, s)
        if trial is None or not _creeps(model, b, b_trial, N, change, h):
            h *= 0.25
            if h < SMALLEST_TIME:
                break
            continue
        size = float(np.max(np.abs(trial - q) / scale))
        q, lam, b = trial, lam_trial, b_trial
        if size < CONVERGED and h >= LARGEST_TIME:
            if not _balanced_forces(model, b, lam, at_start):
                break
            _check_unique(equations, q, b)
            return q, lam, iteration
        h = LARGEST_TIME if size < NEAR else min(h * (10.0 if size < 0.1 * LONGEST else 2.0), LARGEST_TIME)
    raise SimulationError(_nowhere(equations, q, b, change, s))


def _balanced_forces(model: Model, b: RestBlocks, lam: np.ndarray, at_start: float) -> bool:
    """Whether what is left along free motions is small beside forces that cancel there, or those of the start."""
    left = np.abs(basis(model, b.G).T @ b.f)
    parts = np.abs(b.f) + np.abs(b.G.T) @ np.abs(lam)
    # Where no force acts at all, what is left is the rounding of positions times stiffness.
    rounding = ROUNDING * float(np.max(np.abs(b.K) @ model.tables.values.scale_q, initial=0.0))
    return bool(np.all(left <= LEFT * max(float(parts.max(initial=0.0)), at_start) + rounding))


def balanced(equations: RestEquations, q: np.ndarray, lam: np.ndarray, s: float) -> tuple[np.ndarray, RestBlocks]:
    """Multipliers of least norm that balance what they can, and the equations with them."""
    b = equations.at(q, lam, s)
    lam = balancing(b)
    return lam, equations.at(q, lam, s)


def balancing(b: RestBlocks) -> np.ndarray:
    """The multipliers of least norm with the least |f + phi_q^T lam|."""
    if not len(b.phi):
        return np.zeros(0)
    return np.linalg.lstsq(b.G.T, -b.f, rcond=1e-12)[0]


def closed(equations: RestEquations, q: np.ndarray, s: float) -> np.ndarray:
    """The position brought onto the constraints by steps of least norm."""
    model, lam = equations.model, np.zeros(equations.model.n_phi)
    if not model.n_phi:
        return q
    for _ in range(MAX_CLOSING):
        b = model.derivatives.blocks(equations.point(q, lam, s))
        if np.abs(b.r3).max() < CLOSED:
            break
        q = q - np.linalg.lstsq(b.phi_q.toarray(), b.r3, rcond=1e-12)[0]
    return q


def _step(model: Model, b: RestBlocks, N: np.ndarray, h: float) -> np.ndarray:
    """dq of one implicit step from rest."""
    first = ~model.second_order
    A = b.K + b.C / h + np.where(first[:, None], 0.0, b.M) / (h * h)
    if h >= LARGEST_TIME:
        A = b.K
    reduced = N.T @ A @ N
    return N @ np.linalg.lstsq(reduced, -(N.T @ b.f), rcond=1e-13)[0]


def _short(model: Model, change: np.ndarray, scale: np.ndarray) -> bool:
    """Whether a step is finite, and moves bodies, and states with a smallest value, not too far."""
    bounded = np.array([np.isfinite(c.least) for c in model.layout.coordinates])
    bounded[: model.layout.of_bodies] = True
    return bool(np.isfinite(change).all() and np.max(np.abs(change[bounded]) / scale[bounded], initial=0.0) <= LONGEST)


def _creeps(model: Model, b: RestBlocks, after: RestBlocks, N: np.ndarray, change: np.ndarray, h: float) -> bool:
    """Whether bodies go with the force, that of states which change meanwhile included, and it does not turn round."""
    if not np.isfinite(after.f).all():
        return False
    if np.max(np.abs(change) / model.tables.values.scale_q, initial=0.0) < NEAR:
        # What is left of the force may be rounding, which has no direction.
        return True
    k = model.layout.of_bodies
    along = N @ (N.T @ change)
    along[k:] = 0.0
    meanwhile = b.f + (b.K + b.C / h)[:, k:] @ change[k:]
    before, behind = -(meanwhile @ along), -(after.f @ along)
    return bool(before >= 0.0 and behind >= -TURNED * before)


def stiffnesses(b: RestBlocks, N: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Singular values of K along the motions N that are free, falling, and these motions, (k,), (n_q, k)."""
    _, values, motions = np.linalg.svd(N.T @ b.K @ N)
    return values, N @ motions.T


def _check_unique(equations: RestEquations, q: np.ndarray, b: RestBlocks) -> None:
    """Refuse an equilibrium that is one of a continuum.

    Raises:
        SimulationError: names the free motion.
    """
    model = equations.model
    N = basis(model, b.G)
    if not N.shape[1]:
        return
    values, motions = stiffnesses(b, N)
    # Of forces that cancel, rounding is left: it is compared with them, not with itself.
    parts = float(np.max(np.abs(N.T) @ np.abs(b.K) @ np.abs(N)))
    soft = values <= SOFT * max(float(values[0]), parts)
    free = motions[:, soft]
    if not free.shape[1]:
        return
    words = "; ".join(motion_in_words(model, q, free[:, k]) for k in range(min(free.shape[1], 3)))
    raise SimulationError(
        f"the static problem is underdetermined: {_count(free.shape[1])} nothing holds: {words}. Add a spring, a "
        "constraint or a driver there."
    )


def _count(number: int) -> str:
    return "there is a motion that" if number == 1 else f"there are {number} motions that"


def _nowhere(equations: RestEquations, q: np.ndarray, b: RestBlocks, change: np.ndarray, s: float) -> str:
    """Why there is no equilibrium: what moves on."""
    model = equations.model
    values, motions = stiffnesses(b, basis(model, b.G))
    if not len(values):
        return "there is no equilibrium: nothing can move, and the equations of element states have no solution."
    push = np.abs(motions.T @ b.f)
    soft = values <= 1e-6 * max(values[0], np.finfo(float).tiny)
    worst = int(np.argmax(np.where(soft, push, 0.0))) if (soft & (push > 0.0)).any() else -1
    motion = motions[:, worst] if worst >= 0 else (change if np.abs(change).max(initial=0.0) > 0.0 else motions[:, -1])
    return (
        f"no equilibrium was found at load factor {s:.6g}: the system moves on, {motion_in_words(model, q, motion)}. "
        "Look for a load that nothing carries, or follow the path of equilibria to its limit point (`follow_path`)."
    )

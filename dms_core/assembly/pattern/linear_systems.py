"""The two linear systems of a model, ordered: where every derivative goes, and in which order the unknowns go.

An order of elimination is chosen once, on numbers: those at a given state and at states nearby.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from dms_core.assembly.layout import Layout
from dms_core.assembly.pattern.sparsity import NewtonPattern, RatePattern, moved, newton_pattern, rate_pattern
from dms_core.assembly.residual import evaluate_inputs, evaluate_newton, evaluate_rates
from dms_core.assembly.tables import Calls, Signals, Work, new_work
from dms_core.compiled.arena import Packed
from dms_core.errors import ModelError
from dms_core.linear.lu import assemble, factor, storage
from dms_core.linear.ordering import SingularMatrixError
from dms_core.linear.symbolic import LuTables, plan

TYPICAL_C0 = 1.5e3
"""c0 = 1.5 / h of a millisecond step, at which the elimination order is chosen first."""

NEARBY = 0.1
"""Distance of nearby states, at which an elimination order is tried too, in nominal sizes."""
VANISHING = 1e-3
"""Least size of an entry over those states, relative to one of them, below which it is no pivot."""

THRESHOLDS = (0.1, 0.3, 0.03)
"""Sizes that a pivot must have within its row, tried in turn: another threshold, another order."""

GOOD_PIVOT = 1e-9
"""Smallest relative pivot with which no other order is tried: seven digits are left, and the rows of fast first-order
states are by themselves small beside the commands they follow."""


@dataclass
class LinearSystem:
    """One sparse matrix of the model: its scatter by number, and where the elimination order puts the numbers."""

    pattern: Any
    rows: np.ndarray
    columns: np.ndarray
    names: list[str]

    def ordered(self, values: np.ndarray, threshold: float, quick: bool) -> tuple[Any, LuTables]:
        """(scatter into the LU, LU tables) for an elimination order chosen by these values.

        Raises:
            ModelError: the matrix is singular; names the unknowns that nothing determines.
        """
        try:
            lu = plan(len(self.names), self.rows, self.columns, values, threshold=threshold, quick=quick)
        except SingularMatrixError as error:
            names = ", ".join(f"'{self.names[k]}'" for k in error.columns[:4])
            raise ModelError(
                f"the equations are singular: no equation determines {names}. Look for a body without inertia along a "
                "free direction, or an element whose row does not contain its own coordinate."
            ) from error
        return moved(self.pattern, lu.position), lu

    def best_order(self, samples: list[np.ndarray], quick: bool) -> tuple[Any, LuTables]:
        """As `ordered`, with the order whose smallest relative pivot over all samples is the largest.

        An entry that is large at the start and zero later (a saturated command, a slack tendon) must not become a
        pivot: each order is chosen on one sample in which such entries are replaced by their least size. All others
        keep their values: only with them is the rotational inertia of a body, of rank 3 in four columns, singular.

        Args:
            samples: entries at the start, then at nearby states.
            quick: see symbolic.plan.
        """
        least = np.min(np.abs(samples), axis=0)
        best, found, problem = -1.0, None, None
        for sample, threshold in product(samples, THRESHOLDS):
            values = np.where(least < VANISHING * np.abs(sample), np.copysign(least, sample), sample)
            try:
                candidate = self.ordered(values, threshold, quick)
            except ModelError as error:
                problem = error
                continue
            smallest = min(_smallest_pivot(candidate[1], x) for x in samples)
            if smallest > best:
                best, found = smallest, candidate
            if best > GOOD_PIVOT:
                break
        if found is None:
            raise problem  # type: ignore[misc]
        return found


def _smallest_pivot(lu: LuTables, values: np.ndarray) -> float:
    """The smallest pivot, relative to its row, of a factorisation of these entries in that order."""
    a = storage(lu.size)
    assemble(lu, values, a)
    return factor(lu, a, storage(lu.work_size))[0]


class OrderedSystems(NamedTuple):
    """Scatter and elimination order of both systems."""

    newton: NewtonPattern
    newton_lu: LuTables
    rates: RatePattern
    rate_lu: LuTables


class Search(NamedTuple):
    """At how many states near the given one an order of elimination is tried, and how these move."""

    nearby: int
    jolt: float
    """Accelerations there, over nominal rates [1/s]: commands saturate at large ones."""


FROM_THE_START = Search(6, 0.0)
HERE_AND_NOW = Search(0, 0.0)
"""Along the motion, the first order that will do: where entries vanish later pivots weaken, and it is chosen anew."""
WITHIN_A_STEP = Search(6, 100.0)
"""For a matrix that was singular within a step though it is not at the state."""


class Sampling(NamedTuple):
    """Where the numbers come from on which an order is chosen."""

    layout: Layout
    dynamics: Calls
    constraints: Calls
    """With the calls that a step has to evaluate."""
    signals: Signals
    free: np.ndarray
    solved: np.ndarray
    """Coordinates and independent constraint rows that are solved for."""
    scale_q: np.ndarray
    scale_v: np.ndarray
    """Nominal sizes of q and of v, shape (n_q,)."""
    search: Search


def ordered_systems(where: Sampling, q: np.ndarray, v: np.ndarray, t: float, c0: float) -> OrderedSystems:
    """Scatter and elimination orders of both systems, from their values at and near q, v, shape (n_q,), at time t.

    The Newton matrix depends on c0 [1/s] too: in a short step masses outweigh dampers and springs, in a long one the
    other way round, and what is a good pivot in one may be lost in rounding in the other.

    Raises:
        ModelError: the equations are singular there; names the unknowns that nothing determines.
    """
    layout, free, solved, quick = where.layout, where.free, where.solved, where.search.nearby == 0
    work, n_q = new_work(layout), layout.n_q
    work.q[:n_q], work.v[:n_q] = q, v
    dynamics, constraints, w = Packed(where.dynamics), Packed(where.constraints), Packed(work)
    evaluate_inputs(Packed(where.signals).table, t, False, w.table)
    rows, moving = [layout.row_names[k] for k in solved], [layout.names[k] for k in free]
    names = [*(f"{n} (position)" for n in moving), *(f"{n} (velocity)" for n in moving)]
    newton, slots = newton_pattern(layout, free, solved)
    packed = Packed(newton)
    newton, newton_lu = LinearSystem(
        newton, *slots.coordinates(), [*names, *(f"{r} (lam)" for r in rows), *(f"{r} (mu)" for r in rows)]
    ).best_order(_samples(
        where, work, len(slots.number),
        lambda x: evaluate_newton(dynamics.table, constraints.table, packed.table, w.table, c0, x),
    ), quick)  # fmt: skip
    rates, slots = rate_pattern(layout, free, solved)
    packed_rates = Packed(rates)
    rates, rate_lu = LinearSystem(rates, *slots.coordinates(), [*moving, *rows]).best_order(_samples(
        where, work, len(slots.number),
        lambda x: evaluate_rates(dynamics.table, constraints.table, packed_rates.table, w.table, x),
    ), quick)  # fmt: skip
    return OrderedSystems(newton, newton_lu, rates, rate_lu)


def nominal_sizes(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Declared nominal sizes of q and of v, shape (n_q,) each."""
    scales = np.array([(c.scale, c.rate_scale) for c in layout.coordinates])
    return np.ascontiguousarray(scales[:, 0]), np.ascontiguousarray(scales[:, 1])


def _samples(where: Sampling, work: Work, size: int, evaluate: Callable[[np.ndarray], None]) -> list[np.ndarray]:
    """Matrix entries at the state in `work` and at nearby ones, where they are finite."""
    free, scale_q, scale_v, (nearby, jolt) = where.free, where.scale_q, where.scale_v, where.search
    q, v, rng = work.q.copy(), work.v.copy(), np.random.default_rng(0)
    samples = []
    for k in range(1 + nearby):
        values = np.zeros(size)
        if k > 0:
            work.q[free] = q[free] + NEARBY * scale_q[free] * rng.normal(size=len(free))
            work.v[free] = v[free] + scale_v[free] * rng.normal(size=len(free))
            if jolt:
                work.a[free] = jolt * scale_v[free] * rng.normal(size=len(free))
        evaluate(values)
        if k == 0 or np.isfinite(values).all():
            samples.append(values)
    work.q[:], work.v[:] = q, v
    work.a[:] = 0.0
    return samples

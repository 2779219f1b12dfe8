"""A system compiled: laid out, assembled, its linear systems ordered once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from dms_core.assembly.blocks import Derivatives
from dms_core.assembly.elimination import Welds, find_welds, recover
from dms_core.assembly.layout import Layout, same_structure
from dms_core.assembly.parameter_derivatives import ParameterDerivatives
from dms_core.assembly.residual import (
    dense_constraints,
    dense_jacobians,
    evaluate_inputs,
    evaluate_newton,
    evaluate_rates,
)
from dms_core.assembly.sensing import Partials, Sensing, composition, measure
from dms_core.assembly.sparsity import moved, newton_pattern, rate_pattern
from dms_core.assembly.start import Start, assemble
from dms_core.assembly.tables import Calls, Signals, Work, new_work, signal_tables
from dms_core.compiled.arena import Packed, inner
from dms_core.compiled.compilation import announce
from dms_core.compiled.entries import all_calls, moving_calls
from dms_core.errors import ModelError
from dms_core.linear.lu import assemble as assemble_lu
from dms_core.linear.lu import factor, storage
from dms_core.linear.ordering import SingularMatrixError
from dms_core.linear.rank import independent_rows, minimum_norms
from dms_core.linear.symbolic import LuTables, plan
from dms_core.model.system import System
from dms_core.simulation.parts import part_addresses
from dms_core.simulation.state import STATE, Tables, new_state

TYPICAL_C0 = 1.5e3
"""c0 = 1.5 / h of a millisecond step, at which the elimination order is chosen."""

BATCH = 256
"""States whose multipliers are made unique at a time."""

NEARBY_STATES, NEARBY = 6, 0.1
"""Number of states, and their distance from the start in nominal sizes, at which an elimination order is tried."""

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

    def ordered(self, values: np.ndarray, threshold: float) -> tuple[Any, LuTables]:
        """(scatter into the LU, LU tables) for an elimination order chosen by these values.

        Raises:
            ModelError: the matrix is singular; names the unknowns that nothing determines.
        """
        try:
            lu = plan(len(self.names), self.rows, self.columns, values, threshold=threshold)
        except SingularMatrixError as error:
            names = ", ".join(f"'{self.names[k]}'" for k in error.columns[:4])
            raise ModelError(
                f"the equations are singular: no equation determines {names}. Look for a body without inertia along a "
                "free direction, or an element whose row does not contain its own coordinate."
            ) from error
        return moved(self.pattern, lu.position), lu

    def best_order(self, samples: list[np.ndarray]) -> tuple[Any, LuTables]:
        """As `ordered`, with the order whose smallest relative pivot over all samples is the largest.

        An entry that is large at the start and zero later (a saturated command, a slack tendon) must not become a
        pivot: each order is chosen on one sample in which such entries are replaced by their least size. All others
        keep their values: only with them is the rotational inertia of a body, of rank 3 in four columns, singular.

        Args:
            samples: entries at the start, then at nearby states.
        """
        least = np.min(np.abs(samples), axis=0)
        best, found, problem = -1.0, None, None
        for sample, threshold in product(samples, THRESHOLDS):
            values = np.where(least < VANISHING * np.abs(sample), np.copysign(least, sample), sample)
            try:
                candidate = self.ordered(values, threshold)
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
    """Of a factorisation of these entries in that order, relative to its row."""
    a = storage(lu.size)
    assemble_lu(lu, values, a)
    return factor(lu, a, storage(lu.work_size))[0]


class Model:
    """A compiled system: constant tables, a consistent start, and functions of state.

    Args:
        system: the declarations. Kernels are compiled on first use and kept in numba's disk cache.
        like: a model of the same structure (the same elements, joined alike, with other numbers), whose independent
            rows and elimination orders are taken over: much quicker. Ignored where the structure differs.

    Raises:
        ModelError: a declaration does not fit the others.
        AssemblyError: no consistent start exists; names the constraint and by how much it is open.
    """

    def __init__(self, system: System, like: Model | None = None) -> None:
        announce()
        self.system = system
        self.layout = layout = Layout(system)
        self.n_q, self.n_phi = layout.n_q, layout.n_phi
        self._dynamics, self._constraints, self._sensors = (Packed(calls) for calls in all_calls(layout))
        self._signals, self._keep_alive = signal_tables(layout)
        self.second_order = np.array([c.differential_rate for c in layout.coordinates])
        known = like if like is not None and same_structure(like.layout, layout) else None
        # Which rows are redundant depends on the numbers too: an exact alignment may be lost.
        reuse_rows = known is not None and len(known.start.redundant) == 0
        self.start: Start = assemble(self, known.start if known is not None and reuse_rows else None)
        if known is not None and not np.array_equal(self.start.active, known.start.active):
            known = None
        self._welds = Packed(find_welds(layout, self.start.active, self.constraint_jacobian(self.start.q)[2]))
        self.start.v[self.welds.coordinates] = 0.0
        if known:
            self._tables = Packed(self._with_orders_of(known))
        else:
            self._tables = Packed(self._order(self.welds.solved, self.start.q, self.start.v, 0.0))
        self._composed = Packed(composition(layout))
        self._sensor_work = Packed(self.new_work())
        self.sensing = Packed(
            Sensing(self._dynamics, self._constraints, self._sensors, self._composed, self._sensor_work)
        )
        read = {k for e in self._composed.values.constraint if e >= 0 for k in self._rows_of(e)}
        self._reads_welds = bool(read & set(self.welds.rows))

    def _rows_of(self, constraint: int) -> range:
        """Rows of a constraint by its number."""
        call = self.layout.constraints[constraint]
        return range(call.row, call.row + call.rows)

    @property
    def active_rows(self) -> np.ndarray:
        """Independent constraint rows; the others follow from them."""
        return self.start.active

    @property
    def redundant_rows(self) -> list[str]:
        """Names of constraint rows that the others imply."""
        return [self.layout.row_names[k] for k in self.start.redundant]

    @property
    def welds(self) -> Welds:
        """What fixed joints hold on the ground; a step does not solve for it."""
        return self._welds.values

    @property
    def degrees_of_freedom(self) -> int:
        """Mechanical freedoms: coordinates of bodies less independent rows."""
        return sum(len(body.coordinates()) for body in self.system.bodies) - len(self.start.active)

    def new_work(self) -> Work:
        """Fresh work arrays of this model."""
        return new_work(self.layout)

    def new_state(self) -> Packed:
        """A world (a packed State) at the consistent start, with inputs of its own."""
        signals = self._signals._replace(c=self._signals.c.copy(), t=self._signals.t.copy())
        return new_state(self._tables.values, self.new_work(), signals, self.start.q, self.start.v)

    @property
    def numbers(self) -> tuple[np.ndarray, ...]:
        """Numbers of dynamics, constraints and sensors, scales of q and v, inverse of the welds.

        Those of a model of the same structure may be written into them in place; `start` and declarations stay what
        they were.
        """
        calls = (self._dynamics.values, self._constraints.values, self._sensors.values)
        tables = self._tables.values
        return (*(c.par for c in calls), tables.scale_q, tables.scale_v, self.welds.inverse)

    @property
    def tables(self) -> Packed:
        """Constant tables (a packed Tables) for the compiled solver."""
        return self._tables

    def reordered(self, q: np.ndarray, v: np.ndarray, t: float) -> Packed:
        """Tables with independent rows and elimination orders chosen anew at q, v, shape (n_q,).

        Raises:
            ModelError: the equations are singular there.
        """
        calls = self.layout.constraints
        moving = [calls[e] for e in moving_calls(calls, self.welds.free)]
        rows = np.concatenate([np.arange(c.row, c.row + c.rows) for c in moving] + [np.zeros(0, int)]).astype(int)
        G = self.constraint_jacobian(q, v, t)[2][np.ix_(rows, self.welds.free)]
        found, solved = rows[independent_rows(G).independent], self.welds.solved
        return Packed(self._order(found if len(found) >= len(solved) else solved, q, v, t))

    def _solved_calls(self) -> tuple[Calls, Calls]:
        """Dynamics and constraints, with the calls that a step has to evaluate."""
        layout, free = self.layout, self.welds.free
        return (
            self._dynamics.values._replace(moving=moving_calls(layout.dynamics, free)),
            self._constraints.values._replace(moving=moving_calls(layout.constraints, free)),
        )

    def _order(self, solved: np.ndarray, q: np.ndarray, v: np.ndarray, t: float) -> Tables:
        """Scatter and elimination orders of both linear systems, from their values at q, v."""
        layout, free, solved = self.layout, self.welds.free, solved.astype(np.int32)
        work = self.new_work()
        work.q[: self.n_q], work.v[: self.n_q] = q, v
        dynamics, constraints = (Packed(x) for x in self._solved_calls())
        w = Packed(work)
        evaluate_inputs(Packed(self._signals).table, t, False, w.table)
        rows, moving = [layout.row_names[k] for k in solved], [layout.names[k] for k in free]
        names = [*(f"{n} (position)" for n in moving), *(f"{n} (velocity)" for n in moving)]
        newton, slots = newton_pattern(layout, free, solved)
        packed = Packed(newton)
        newton, newton_lu = LinearSystem(
            newton, *slots.coordinates(), [*names, *(f"{r} (lam)" for r in rows), *(f"{r} (mu)" for r in rows)]
        ).best_order(self._samples(
            work, len(slots.number),
            lambda x: evaluate_newton(dynamics.table, constraints.table, packed.table, w.table, TYPICAL_C0, x),
        ))  # fmt: skip
        rates, slots = rate_pattern(layout, free, solved)
        packed_rates = Packed(rates)
        rates, rate_lu = LinearSystem(rates, *slots.coordinates(), [*moving, *rows]).best_order(
            self._samples(
                work, len(slots.number),
                lambda x: evaluate_rates(dynamics.table, constraints.table, packed_rates.table, w.table, x),
            )
        )  # fmt: skip
        scales = np.array([(c.scale, c.rate_scale) for c in layout.coordinates])
        scale_q, scale_v = np.ascontiguousarray(scales[:, 0]), np.ascontiguousarray(scales[:, 1])
        return Tables(
            dynamics.values, constraints.values, self._sensors.values, newton, newton_lu, rates, rate_lu, free, solved,
            self.second_order, scale_q, scale_v, sum(len(c.iu) > 0 for c in layout.constraints), part_addresses(),
        )  # fmt: skip

    def _with_orders_of(self, like: Model) -> Tables:
        """Tables with this model's numbers and the other's scatter and elimination orders."""
        known = like.tables.values
        dynamics = self._dynamics.values._replace(moving=known.dynamics.moving)
        constraints = self._constraints.values._replace(moving=known.constraints.moving)
        scales = np.array([(c.scale, c.rate_scale) for c in self.layout.coordinates])
        changed: dict[str, Any] = {"dynamics": dynamics, "constraints": constraints, "sensors": self._sensors.values}
        changed |= {"scale_q": np.ascontiguousarray(scales[:, 0]), "scale_v": np.ascontiguousarray(scales[:, 1])}
        return Tables(**{**known._asdict(), **changed})

    def _samples(self, work: Work, size: int, evaluate: Callable[[np.ndarray], None]) -> list[np.ndarray]:
        """Matrix entries at the state in `work` and at nearby ones, where they are finite."""
        scales = np.array([(c.scale, c.rate_scale) for c in self.layout.coordinates])
        q, v, rng = work.q.copy(), work.v.copy(), np.random.default_rng(0)
        samples = []
        for k in range(1 + NEARBY_STATES):
            values = np.zeros(size)
            if k > 0:
                free = self.welds.free
                work.q[free] = q[free] + NEARBY * scales[free, 0] * rng.normal(size=len(free))
                work.v[free] = v[free] + scales[free, 1] * rng.normal(size=len(free))
            evaluate(values)
            if k == 0 or np.isfinite(values).all():
                samples.append(values)
        work.q[:], work.v[:] = q, v
        return samples

    def input_index(self, name: str) -> int:
        """Index of an input; an unknown name is an error that lists the inputs."""
        self.system.element(name)
        return self.layout._find(name, self.layout.input_index, "input", f"system '{self.system.name}'")

    def constraint_jacobian(self, q: np.ndarray, v: np.ndarray | None = None, t: float = 0.0) -> tuple[np.ndarray, ...]:
        """(phi, phi_q v + phi_t, phi_q, (phi_q v)_q) at q, v: shapes (n_phi,), (n_phi,), (n_phi, n_q) twice."""
        w = self.new_work()
        w.q[: self.n_q] = q
        w.v[: self.n_q] = 0.0 if v is None else v
        packed = Packed(w)
        evaluate_inputs(Packed(self._signals).table, t, False, packed.table)
        G, W = np.zeros((self.n_phi, self.n_q + 7)), np.zeros((self.n_phi, self.n_q + 7))
        dense_constraints(self._constraints.table, packed.table, G, W)
        return w.phi.copy(), w.phi_v.copy(), G[:, : self.n_q], W[:, : self.n_q]

    def unique_multipliers(self, q: np.ndarray, lam: np.ndarray) -> np.ndarray:
        """The least-norm multipliers of the same constraint force phi_q^T lam, shapes (k, n_q) and (k, n_phi).

        With redundant constraints only the force is determined, not its share per joint; the least norm is a
        convention, and a reaction read from it is one of many possible ones.
        """
        if not len(self.start.redundant):
            return lam
        unique, w = np.empty_like(lam), Packed(self.new_work())
        for k in range(0, len(q), BATCH):
            some = np.ascontiguousarray(q[k : k + BATCH])
            G = np.zeros((len(some), self.n_phi, self.n_q + 7))
            dense_jacobians(self._constraints.table, w.table, some, G)
            unique[k : k + BATCH] = minimum_norms(G[:, :, : self.n_q], lam[k : k + BATCH])
        return unique

    def whole_multipliers(self, signals: Signals, t, q, v, a, lam, behind) -> np.ndarray:  # noqa: ANN001
        """Multipliers with those of welded bodies, which a run leaves 0, recovered; shape (k, n_phi)."""
        if not len(self.welds.rows):
            return lam
        found = np.ascontiguousarray(lam).copy()
        self._recover(Packed(signals).table, t, q, v, a, found, behind)
        return found

    def _recover(self, signals: np.ndarray, t, q, v, a, lam, behind) -> None:  # noqa: ANN001
        recover(self.sensing.table, self._welds.table, signals, t, q, v, a, lam, behind)

    def measure(self, signals: Signals, t, q, v, a, lam, behind) -> np.ndarray:  # noqa: ANN001
        """Sensors at given states with the given inputs: shape (k, n_y); behind[k] takes inputs behind a jump."""
        y = np.zeros((len(t), len(self.layout.outputs)))
        measure(self.sensing.table, Packed(signals).table, t, q, v, a, lam, behind, y)
        return y

    def measure_into(self, world: np.ndarray, t, q, v, a, lam, behind, y) -> None:  # noqa: ANN001
        """As `measure`, with the inputs of a packed world, into y; reactions of welded bodies are recovered."""
        if self._reads_welds:
            lam = lam.copy()
            self._recover(inner(world, STATE.signals), t, q, v, a, lam, behind)
        measure(self.sensing.table, inner(world, STATE.signals), t, q, v, a, lam, behind, y)

    @cached_property
    def derivatives(self) -> Derivatives:
        """Residual and sensors with their derivatives at any operating point."""
        return Derivatives(self)

    @cached_property
    def parameter_derivatives(self) -> ParameterDerivatives:
        """Derivatives of residual and sensors by declared numbers."""
        return ParameterDerivatives(self)

    def sensor_partials(self, t: float, q, v, a, lam) -> Partials:  # noqa: ANN001
        """Derivatives of all sensor components by q, v, vdot, lam, u at one state (paper eq. 6), dense.

        Inputs are the declared ones at t; those by u are by their values. `World.sensor_blocks` takes a world's inputs.
        """
        w, n = self._sensor_work.values, self.n_q
        w.q[:n], w.v[:n], w.a[:n], w.lam[:] = q, v, a, lam
        evaluate_inputs(Packed(self._signals).table, t, False, self._sensor_work.table)
        into = self.derivatives.partials()
        by_input = into.u + self.derivatives.inputs.of_moments()[:, :, 0]
        return Partials(into.q[:, :n], into.v[:, :n], into.a[:, :n], into.lam, by_input)

"""A system compiled: laid out, assembled, its linear systems ordered once."""

from __future__ import annotations

import warnings
from functools import cached_property
from typing import Any

import numpy as np

from dms_core.assembly.derivatives.blocks import Derivatives
from dms_core.assembly.derivatives.finite import check_finite, naming_far_numbers, open_call
from dms_core.assembly.derivatives.parameter_derivatives import ParameterDerivatives
from dms_core.assembly.layout import Call, Layout, same_structure
from dms_core.assembly.pattern.elimination import Welds, find_welds, recover
from dms_core.assembly.pattern.linear_systems import (
    FROM_THE_START,
    HERE_AND_NOW,
    TYPICAL_C0,
    WITHIN_A_STEP,
    Sampling,
    Search,
    nominal_sizes,
    ordered_systems,
)
from dms_core.assembly.pattern.order_code import ORDER_CODE
from dms_core.assembly.pattern.sparse_constraints import SparseConstraints
from dms_core.assembly.readings.sensing import SENSING_CODE, composition, measure, new_sensing
from dms_core.assembly.residual import dense_constraints, dense_jacobians, evaluate_inputs, evaluate_rates
from dms_core.assembly.start import Start, assemble
from dms_core.assembly.tables import Signals, Tables, Work, new_work, signal_tables
from dms_core.compiled import side_by_side
from dms_core.compiled.arena import Packed
from dms_core.compiled.compilation import announce
from dms_core.compiled.entries import all_calls, moving_calls, solved_calls
from dms_core.errors import ModelError, ModelWarning, choices
from dms_core.linear.rank import independent_rows, minimum_norms, multipliers_of
from dms_core.model.system import System

SPARSE_ROWS = 500
"""Rows of phi_q up to which dense methods are quicker, and tell the rank more sharply."""
MOVED_TOLERANCE = 1e-6
"""Share of the largest singular value below which a row that was redundant at the start still is, along the motion."""
BATCH = 256
"""States whose multipliers are made unique at a time."""


def _warn_of_unread_inputs(layout: Layout) -> None:
    if unread := layout.unread_inputs():
        names = ", ".join(f"'{name}'" for name in unread)
        verb = "input is" if len(unread) == 1 else "inputs are"
        warnings.warn(
            f"system '{layout.system.name}': the {verb} read by no element: {names}. Look for a misspelt name, or "
            "remove what is not needed.",
            ModelWarning,
            stacklevel=3,
        )


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
        side_by_side.begin([ORDER_CODE, SENSING_CODE, *side_by_side.registered()], evaluate_rates)
        self.layout = layout = Layout(system)
        _warn_of_unread_inputs(layout)
        self.n_q, self.n_phi = layout.n_q, layout.n_phi
        self._dynamics, self._constraints, self._sensors = (Packed(calls) for calls in all_calls(layout))
        self._signals, self._keep_alive = signal_tables(layout)
        self.second_order = np.array([c.differential_rate for c in layout.coordinates])
        with naming_far_numbers(system):
            self._solve_start(like)
        self._composed = Packed(composition(layout))
        self._sensor_work = Packed(self.new_work())
        self.sensing = new_sensing(self._dynamics, self._constraints, self._sensors, self._composed, self._sensor_work)
        read = {k for e in self._composed.values.constraint if e >= 0 for k in self._rows_of(e)}
        self._reads_welds = bool(read & set(self.welds.rows))

    def _solve_start(self, like: Model | None) -> None:
        """Start, welds and tables; rows and orders of elimination of `like` where it has the same structure."""
        layout = self.layout
        known = like if like is not None and same_structure(like.layout, layout) else None
        # Which rows are redundant depends on the numbers too: an exact alignment may be lost.
        reuse_rows = known is not None and len(known.start.redundant) == 0
        rows_of = known.start if known is not None and reuse_rows else None
        q, v = layout.start()
        check_finite(layout, self.open_call(q[: self.n_q], v[: self.n_q], constraints_only=True))
        self.start: Start = assemble(layout, self._signals, self.jacobian, rows_of)
        if known is not None and not np.array_equal(self.start.active, known.start.active):
            known = None
        check_finite(layout, self.open_call(self.start.q, self.start.v))
        self._welds = Packed(find_welds(layout, self.start.active, self.jacobian(self.start.q)[2]))
        self.start.v[self.welds.coordinates] = 0.0
        if known:
            self._tables = Packed(self._with_orders_of(known))
        else:
            self._tables = Packed(self._order(
                self.welds.solved, self.start.q, self.start.v, 0.0, self._signals, TYPICAL_C0, FROM_THE_START,
                nominal_sizes(layout),
            ))  # fmt: skip

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
        return self.layout.of_bodies - len(self.start.active)

    def new_work(self) -> Work:
        """Fresh work arrays of this model."""
        return new_work(self.layout)

    def new_signals(self) -> Signals:
        """The declared inputs, whose values may be set: a copy for one world."""
        return self._signals._replace(c=self._signals.c.copy(), t=self._signals.t.copy())

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

    def reordered(
        self, q: np.ndarray, v: np.ndarray, t: float, signals: Signals, c0: float = TYPICAL_C0, nearby: bool = False
    ) -> Packed:
        """Tables with independent rows and elimination orders chosen anew at a state; numbers are the model's own.

        Args:
            q: position, shape (n_q,).
            v: velocity, shape (n_q,).
            t: time [s].
            signals: inputs.
            c0: leading coefficient of the step [1/s] that the order is for.
            nearby: look at nearby states too, at which commands saturate; that takes longer.

        Raises:
            ModelError: the equations are singular there.
        """
        G = self.jacobian(q, v, t)[2][self._moving_rows][:, self.welds.free]
        # Along the motion rows are closed to a tolerance only, within which those that depend on others seem not to.
        found = self._moving_rows[independent_rows(G, MOVED_TOLERANCE, len(self.welds.solved)).independent]
        sizes = self._tables.values.scale_q, self._tables.values.scale_v
        return Packed(self._order(found, q, v, t, signals, c0, WITHIN_A_STEP if nearby else HERE_AND_NOW, sizes))

    @cached_property
    def _moving_rows(self) -> np.ndarray:
        """Rows of constraints that see a coordinate which is solved for."""
        calls = self.layout.constraints
        moving = [calls[e] for e in moving_calls(calls, self.welds.free)]
        return np.concatenate([np.arange(c.row, c.row + c.rows) for c in moving] + [np.zeros(0, int)]).astype(int)

    def carried_over(self, q: np.ndarray, multipliers: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Multipliers of these independent rows, the others 0, with the force phi_q^T lam of the given ones.

        Args:
            q: position, shape (n_q,).
            multipliers: sets of multipliers, shape (k, n_phi).
            rows: the rows that are solved for.
        """
        G, carried = self.jacobian(q)[2], np.zeros_like(multipliers)
        carried[:, rows] = multipliers_of(G[rows], (G.T @ multipliers.T).T)
        return carried

    def _order(
        self, solved: np.ndarray, q: np.ndarray, v: np.ndarray, t: float, signals: Signals, c0: float, search: Search,
        sizes: tuple[np.ndarray, np.ndarray],
    ) -> Tables:  # fmt: skip
        """Tables with scatter and elimination orders of both linear systems chosen at q, v and the inputs at t.

        `sizes` are the nominal ones of q and v; the tables hold these very arrays.
        """
        layout, free, solved = self.layout, self.welds.free, solved.astype(np.int32)
        side_by_side.wait_for(ORDER_CODE)
        dynamics = solved_calls(self._dynamics.values, layout.dynamics, free)
        constraints = solved_calls(self._constraints.values, layout.constraints, free)
        where = Sampling(layout, dynamics, constraints, signals, free, solved, *sizes, search)
        systems = ordered_systems(where, q, v, t, c0)
        return Tables(
            dynamics, constraints, self._sensors.values, *systems, free, solved, self.second_order,
            *sizes, sum(len(c.iu) > 0 for c in layout.constraints),
            len(self._moving_rows) - len(solved), np.array([c0]),
        )  # fmt: skip

    def _with_orders_of(self, like: Model) -> Tables:
        """Tables with this model's numbers and the other's scatter and elimination orders."""
        known = like.tables.values
        dynamics, constraints = (
            own._replace(moving=of.moving, solved=of.solved, solved_ptr=of.solved_ptr)
            for own, of in ((self._dynamics.values, known.dynamics), (self._constraints.values, known.constraints))
        )
        scale_q, scale_v = nominal_sizes(self.layout)
        return known._replace(
            dynamics=dynamics, constraints=constraints, sensors=self._sensors.values, scale_q=scale_q, scale_v=scale_v
        )

    def input_index(self, name: str) -> int:
        """Index of an input; an unknown name is an error that lists the inputs."""
        self.system.element(name)
        if name not in self.layout.input_index:
            raise ModelError(
                f"system '{self.system.name}': '{name}' is no input. Declared: {choices(self.layout.input_index)}."
            )
        return self.layout.input_index[name]

    def open_call(self, q: np.ndarray, v: np.ndarray, t: float = 0.0, constraints_only: bool = False) -> Call | None:
        """The first element whose equations, or their derivatives, are not finite at q, v, shape (n_q,); else None."""
        dynamics = self._dynamics.values
        if constraints_only:
            dynamics = dynamics._replace(kernel=dynamics.kernel[:0])
        w = self._work_at(q, v, t)
        return open_call(self.layout, Packed(dynamics).table, self._constraints.table, w.table)

    def _work_at(self, q: np.ndarray, v: np.ndarray | None, t: float, before: bool = False) -> Packed:
        """Fresh work arrays at a state with the declared inputs; without v it is at rest."""
        w = self.new_work()
        w.q[: self.n_q] = q
        w.v[: self.n_q] = 0.0 if v is None else v
        packed = Packed(w)
        evaluate_inputs(Packed(self._signals).table, t, before, packed.table)
        return packed

    def constraint_jacobian(
        self, q: np.ndarray, v: np.ndarray | None = None, t: float = 0.0, before: bool = False
    ) -> tuple[np.ndarray, ...]:
        """(phi, phi_q v + phi_t, phi_q, (phi_q v)_q) at q, v: shapes (n_phi,), (n_phi,), (n_phi, n_q) twice.

        `before` takes the inputs from the left of a jump at t.
        """
        w = self._work_at(q, v, t, before)
        G, W = np.zeros((self.n_phi, self.n_q + 7)), np.zeros((self.n_phi, self.n_q + 7))
        dense_constraints(self._constraints.table, w.table, G, W)
        return w.values.phi, w.values.phi_v, G[:, : self.n_q], W[:, : self.n_q]

    def jacobian(self, q: np.ndarray, v: np.ndarray | None = None, t: float = 0.0) -> tuple[Any, ...]:
        """As `constraint_jacobian`; for more than SPARSE_ROWS rows phi_q is a CSR array, and (phi_q v)_q is None."""
        if self.n_phi <= SPARSE_ROWS:
            return self.constraint_jacobian(q, v, t)
        w = self._work_at(q, v, t)
        G = self._sparse_constraints(w)
        return w.values.phi, w.values.phi_v, G, None

    @cached_property
    def _sparse_constraints(self) -> SparseConstraints:
        return SparseConstraints(self.layout, self._constraints)

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

    def measure_into(self, signals: np.ndarray, t, q, v, a, lam, behind, y) -> None:  # noqa: ANN001
        """As `measure`, with the packed inputs of a world, into y; reactions of welded bodies are recovered."""
        if self._reads_welds:
            lam = lam.copy()
            self._recover(signals, t, q, v, a, lam, behind)
        measure(self.sensing.table, signals, t, q, v, a, lam, behind, y)

    @cached_property
    def derivatives(self) -> Derivatives:
        """Residual and sensors with their derivatives at any operating point."""
        return Derivatives(self.layout, self.sensing)

    @cached_property
    def parameter_derivatives(self) -> ParameterDerivatives:
        """Derivatives of residual and sensors by declared numbers."""
        return ParameterDerivatives(self.layout, self.sensing, self.derivatives)

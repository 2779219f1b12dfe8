"""A way into a world for estimation, sensitivities, statics and modes: what the solver knows, asked for from outside.

Nothing here is part of a step. An operating point is a state with its inputs; at it, the residual of the equations, the
sensors, their derivatives, and the factorised matrix of a step can be asked for.
"""

from __future__ import annotations

import numpy as np

from dms_core.assembly.derivatives.blocks import Blocks, OperatingPoint, SensorBlocks
from dms_core.assembly.derivatives.parameter_derivatives import ParameterBlocks
from dms_core.assembly.model import Model
from dms_core.assembly.residual import evaluate_inputs
from dms_core.compiled.arena import Packed, inner
from dms_core.errors import ModelError, SimulationError
from dms_core.linear.null_space import null_space
from dms_core.model.system import System
from dms_core.results import Result
from dms_core.simulation import snapshot
from dms_core.simulation.iteration.newton_matrix import NewtonMatrix
from dms_core.simulation.options import SolverOptions
from dms_core.simulation.snapshot import Snapshot
from dms_core.simulation.state import STATE, State


class Inspection:
    """What a World offers besides going on in time."""

    model: Model
    options: SolverOptions
    result: Result
    state: State
    _tables: Packed
    _world: Packed

    @property
    def time(self) -> float:
        """Time reached [s]."""
        raise NotImplementedError

    def snapshot(self) -> Snapshot:
        """Everything that the future of this world depends on, as an immutable value that can be pickled."""
        return snapshot.take(self.model, self._tables.values, self.state, self.options, self.result, self.ending)

    def restore(self, past: Snapshot) -> None:
        """Be the world that `past` was taken of: going on gives the same bits as going on from there.

        The arrays stay where they are, unless the order of elimination is another one (then, as behind `reorder`,
        `tables`, `packed` and `state` are new).

        Raises:
            InputError: the snapshot belongs to another model, to other numbers of it, or to other options.
        """
        snapshot.check(past, self.model, self.state.signals, self.options)
        tables = snapshot.tables_with(past.orders, self._tables, self.model)
        self._world = snapshot.put_back(past, tables, self._tables, self._world)
        self._tables, self.state, self.result = tables, self._world.values, past.result
        self.ending = past.ending

    def operating_point(self, behind: bool = False) -> OperatingPoint:
        """The present state with the present inputs; `behind` takes the inputs behind a jump at the present time.

        vdot and lam are those of the last step; behind a jump, and before the first step, `settle` renews them.
        """
        s, t, model = self.state, np.array([self.time]), self.model
        evaluate_inputs(inner(self._world.table, STATE.signals), self.time, not behind, model.sensing.values.work.table)
        u = model.sensing.values.work.values.u.copy()
        model.layout.put_driven(u[:, 0], s.v)
        lam = model.whole_multipliers(s.signals, t, s.q[None], s.v[None], s.vd[None], s.lam[None], np.array([behind]))
        return OperatingPoint(s.q.copy(), s.qd.copy(), s.v.copy(), s.vd.copy(), lam[0].copy(), s.mu.copy(), u)

    def blocks(self, point: OperatingPoint | None = None) -> Blocks:
        """Residual r1 to r4 (paper eq. 2) and its derivatives by q, v, vdot, lam, mu, u; at the present point."""
        return self.model.derivatives.blocks(self.operating_point() if point is None else point)

    def sensor_blocks(self, point: OperatingPoint | None = None) -> SensorBlocks:
        """Sensors (paper eq. 5) and their derivatives by q, v, vdot, lam, mu, u (eq. 6); at the present point."""
        return self.model.derivatives.sensor_blocks(self.operating_point() if point is None else point)

    def parameter_blocks(
        self, element: str, number: str, point: OperatingPoint | None = None, system: System | None = None
    ) -> ParameterBlocks:
        """Derivatives of residual and sensors by one declared number; at the present point.

        Args:
            element: name of a declaration.
            number: its number by keys and places, as 'mass', 'inertia.2', 'path.1.point.0', 'curves.active_shape'.
            point: where; default the present operating point.
            system: declares the present numbers; default the model's own. Needed where other numbers were written into
                the model, as an environment does for each patient; its elements must be the same.

        Raises:
            InputError: there is no such number, or the present numbers of what it moves are not those of the system.
        """
        at = self.operating_point() if point is None else point
        return self.model.parameter_derivatives.of(element, number, at, system)

    def newton_matrix(self, c0: float, point: OperatingPoint | None = None) -> NewtonMatrix:
        """d(r1, r2, r3, r4) / d(q, v, lam, mu) with qdot = c0 q + ..., vdot = c0 v + ..., factorised at a point.

        Where the world's order of elimination is singular, another one is chosen for this matrix.

        Raises:
            SimulationError: the matrix is singular in every order.
        """
        at = self.operating_point() if point is None else point
        self.model.derivatives.put(at)
        work = self.model.sensing.values.work
        try:
            return NewtonMatrix(self._tables, work, c0)
        except SimulationError:
            try:
                tables = self.model.reordered(at.q, at.v, self.time, self.state.signals)
                return NewtonMatrix(tables, work, c0)
            except ModelError as error:
                raise SimulationError(f"the Newton matrix is singular at this state: {error}") from error

    def null_space(self, q: np.ndarray | None = None) -> np.ndarray:
        """Orthonormal N with phi_q N = 0, shape (n_q, freedoms): dq = N dz; at q, or at the present position."""
        return null_space(self.model.constraint_jacobian(self.state.q if q is None else np.asarray(q, float))[2])

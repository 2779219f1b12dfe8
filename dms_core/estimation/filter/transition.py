"""The derivative of a period: how the state at its end follows from the state and inputs at its begin.

    x1 = A x0 + B u + D p        over one period of equal steps of SDIRK2, in the charts at both ends

The steps are solved and differentiated together (sensitivity/tangents/steps.py): tangents of x0, of inputs that are
held over the period and of declared numbers go through every stage in all coordinates, and the charts enter at the two
ends only. A number that moves constraints moves the start, too, while x0 stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dms_core.analyses.linearise import Linearisation, linearise
from dms_core.assembly.derivatives.input_derivatives import STEP
from dms_core.assembly.derivatives.parameter_derivatives import Direction
from dms_core.errors import SimulationError
from dms_core.estimation.filter.charts import Chart, chart_at
from dms_core.estimation.filter.nominal_world import FINER, NominalWorld
from dms_core.model.system import System
from dms_core.sensitivity.tangents.steps import carry_forward, differentiated_step
from dms_core.sensitivity.tangents.tables import KIND, Columns, new_columns, new_differentials, new_movement


class Transition(NamedTuple):
    """End of a period, and its derivatives."""

    q: np.ndarray
    v: np.ndarray
    chart: Chart
    A: np.ndarray
    """Shape (n_x1, n_x0)."""
    B: np.ndarray
    """By the inputs asked for, held over the period, shape (n_x1, inputs)."""
    D: np.ndarray
    """By the declared numbers, shape (n_x1, numbers)."""


class MovedNumber(NamedTuple):
    """A declared number that a period is differentiated by."""

    direction: Direction
    dq: np.ndarray
    """By which the start moves with it, while x of the chart stays, shape (n_q,)."""
    dv: np.ndarray


def moved_number(world: NominalWorld, chart: Chart, key: tuple[str, str], system: System) -> MovedNumber:
    """A declared number at the present state of a world.

    Args:
        world: where it is.
        chart: there.
        key: element and path of the number.
        system: declares the numbers that the model has now.
    """
    known = world.model.parameter_derivatives
    direction = known.direction(*key, system)
    dq, dv = np.zeros(world.model.n_q), np.zeros(world.model.n_q)
    if direction.constraints.any():
        world.settled()
        point = world.operating_point(behind=True)
        blocks = known.of(*key, point, system)
        W = world.model.constraint_jacobian(point.q, point.v, world.time)[3]
        dq = -chart.L @ blocks.r3[chart.rows]
        dv = -chart.L @ (W[chart.rows] @ dq + blocks.r4[chart.rows])
    return MovedNumber(direction, dq, dv)


class Transitions:
    """Differentiated periods of a world.

    Args:
        world: that is advanced.
        inputs: places of the inputs to differentiate by.
    """

    def __init__(self, world: NominalWorld, inputs: Sequence[int]) -> None:
        self.world, self.inputs = world, tuple(inputs)
        self._renew()

    def _renew(self, numbers: Sequence[MovedNumber] = ()) -> None:
        """Storage for the rows and orders that the world is solved with now, and for what these numbers move."""
        self._tables = self.world.tables
        self._movements = [new_movement(self._tables.values, x.direction) for x in numbers]
        self._differentials = new_differentials(
            self.world.model, self._tables.values, self.world.state.w, self._movements
        )
        self._columns = new_columns(self.world.model, len(self.inputs))

    def over(self, chart: Chart, t: float, steps: int, numbers: Sequence[MovedNumber] = ()) -> Transition:
        """Advance the world to t [s], in more steps where Newton's method needs them.

        Args:
            chart: at the begin, where the world is.
            t: end of the period [s].
            steps: of the period.
            numbers: declared numbers to differentiate by.

        Raises:
            SimulationError: the equations cannot be solved on the way.
        """
        world = self.world
        begin, h = world.mark(), (t - world.time) / steps
        for finer in range(FINER):
            world.settled()
            if world.tables is not self._tables or numbers:
                self._renew(numbers)
            if self._advanced(chart, h / (1 << finer), steps << finer, numbers):
                return self._at_the_end(chart, t)
            world.rewind(begin)
        # It fails here too, and says where and why; or it helps itself by another order of elimination.
        world.go(t, steps)
        raise SimulationError(f"the steps up to t = {t:.6g} s cannot be differentiated.")

    def _advanced(self, chart: Chart, h: float, steps: int, numbers: Sequence[MovedNumber]) -> bool:
        """Steps of size h, and all columns through them; False where one cannot be solved."""
        world, first = self.world, chart.size + len(self.inputs)
        count = first + len(numbers)
        if len(self._columns.values.dq) != count:
            self._columns = new_columns(world.model, count)
        c: Columns = self._columns.values
        c.dq[:], c.dv[:], c.du[:] = 0.0, 0.0, 0.0
        c.dq[: chart.size], c.dv[: chart.size] = chart.dq.T, chart.dv.T
        for k, place in enumerate(self.inputs):
            c.du[chart.size + k, 3 * place] = c.du[count + chart.size + k, 3 * place] = 1.0
        c.parameter[:] = -1
        for k, number in enumerate(numbers):
            c.dq[first + k], c.dv[first + k], c.parameter[first + k] = number.dq, number.dv, k
        m, s, o, d = world.tables.table, world.packed.table, world.numbers, self._differentials.table
        for _ in range(steps):
            if not differentiated_step(m, s, o, d, h, KIND.sdirk2):
                return False
            carry_forward(m, d, self._columns.table)
        return bool(np.isfinite(c.dq).all() and np.isfinite(c.dv).all())

    def _at_the_end(self, chart: Chart, t: float) -> Transition:
        """The end of a period whose columns have arrived."""
        world, c = self.world, self._columns.values
        q, v = world.state.q.copy(), world.state.v.copy()
        end = chart_at(world.model, q, v, t, chart)
        x = end.read(c.dq.T, c.dv.T)
        A, B, D = np.split(x, [chart.size, chart.size + len(self.inputs)], axis=1)
        return Transition(q, v, end, A.copy(), B.copy(), D.copy())


def in_chart(chart: Chart, linear: Linearisation) -> np.ndarray:
    """x of the linearisation by x of the chart, shape (n_x, n_x)."""
    names, n_z = chart.model.layout.index, len(chart.chosen)
    theirs = [names[name[2:]] for name in linear.states[:n_z]]
    return np.concatenate([chart.dq[theirs], chart.dv[theirs], chart.dq[chart.first]])


def linear_here(world: NominalWorld) -> Linearisation:
    """The equations linearised at the present state of a world.

    Raises:
        SimulationError: no rates belong to the state.
    """
    world.settled()
    return linearise(world.model, world.operating_point(behind=True))


def difference_step(value: float) -> float:
    """Step of a central difference by a declared number of this size."""
    return STEP * (abs(value) or 1.0)

"""The derivative of a period: how the state at its end follows from the state, inputs and constants at its begin.

    x1 = A x0 + B u + B_p p        over one period of equal steps, in the charts at both ends

A and B are those of the step itself applied to the equations linearised at the begin (`linearise`): with
Z = h [[A_c, B_c], [0, 0]], one step of SDIRK2 is R(Z) = (1 - g Z)^-2 (1 + (1 - 2 g) Z), g = 1 - 1/sqrt 2, which is the
step's own derivative where the equations are linear. By constants the period is differenced.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dms_core.analyses.linearise import Linearisation, linearise
from dms_core.assembly.input_derivatives import STEP
from dms_core.estimation.charts import Chart, chart_at
from dms_core.estimation.nominal_world import NominalWorld
from dms_core.simulation.sdirk2 import GAMMA


class Transition(NamedTuple):
    """End of a period, and its derivatives."""

    q: np.ndarray
    v: np.ndarray
    chart: Chart
    A: np.ndarray
    """Shape (n_x1, n_x0)."""
    B: np.ndarray
    """By the inputs asked for, held over the period, shape (n_x1, inputs)."""


def in_chart(chart: Chart, linear: Linearisation) -> np.ndarray:
    """x of the linearisation by x of the chart, shape (n_x, n_x)."""
    names, n_z = chart.model.layout.index, len(chart.chosen)
    theirs = [names[name[2:]] for name in linear.states[:n_z]]
    return np.concatenate([chart.dq[theirs], chart.dv[theirs], chart.dq[chart.first]])


def transition(
    world: NominalWorld, chart: Chart, linear: Linearisation, t: float, steps: int, inputs: Sequence[int]
) -> Transition:
    """Advance a world to t [s] and differentiate the way there.

    Args:
        world: at the begin of the period, with its inputs.
        chart: there.
        linear: the equations there.
        t: end of the period [s].
        steps: of the period.
        inputs: places of the inputs to differentiate by.

    Raises:
        SimulationError: the equations cannot be solved on the way.
    """
    model, n = world.model, chart.size
    dt = t - world.time
    steps = world.go(t, steps)
    h = dt / steps
    Z = np.zeros((n + len(inputs), n + len(inputs)))
    Z[:n, :n], Z[:n, n:] = h * linear.A, h * linear.B[:, list(inputs)]
    one = np.eye(len(Z))
    inverse = np.linalg.inv(one - GAMMA * Z)
    whole = np.linalg.matrix_power(inverse @ inverse @ (one + (1.0 - 2.0 * GAMMA) * Z), steps)
    q, v = world.state.q.copy(), world.state.v.copy()
    end = chart_at(model, q, v, t, chart)
    back = np.linalg.inv(in_chart(end, linear))
    return Transition(q, v, end, back @ whole[:n, :n] @ in_chart(chart, linear), back @ whole[:n, n:])


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

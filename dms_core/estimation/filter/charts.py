"""The chart x = (z, w, s) of a state: independent coordinates, their rates, and states of first order.

    dq = N dz + (ds in its rows),    dv = N dw - L (phi_q v)_q N dz

with N, L of `analyses.independent`. A filter corrects x; `placed` goes back to q and v on the constraints, with z, w
and s kept to the last digit:  phi(q) = 0 by Newton's method along L,  v = N w - L phi_t.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dms_core.analyses.independent import Independent, independent, state_names, with_chosen
from dms_core.assembly.model import Model
from dms_core.errors import SimulationError

CLOSED, ITERATIONS = 1e-13, 20
"""Largest |phi| left by a projection, over the sizes of the coordinates, and its iterations."""
STEEP = 5.0
"""Largest entry of N up to which a chart is kept: beyond, other coordinates tell the motion better."""


@dataclass(frozen=True)
class Chart:
    """Which coordinates are independent, and how the others follow at one state."""

    model: Model
    chosen: np.ndarray
    """Independent coordinates of second order, shape (n_z,)."""
    first: np.ndarray
    """Coordinates of first order, shape (n_f,)."""
    rows: np.ndarray
    """Independent constraint rows."""
    N: np.ndarray
    """Shape (n_q, n_z)."""
    L: np.ndarray
    """Shape (n_q, rows)."""
    dq: np.ndarray
    """dq by x, shape (n_q, n_x)."""
    dv: np.ndarray
    """dv by x, rows of first-order coordinates 0, shape (n_q, n_x)."""

    @property
    def size(self) -> int:
        """Number of states."""
        return 2 * len(self.chosen) + len(self.first)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of x."""
        return state_names(self.model, self.chosen, self.first)

    def read(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """x of a state, or of displacements as columns: shape (n_x, ...)."""
        return np.concatenate([q[self.chosen], v[self.chosen], q[self.first]])

    @property
    def steep(self) -> bool:
        """Whether other coordinates would tell the motion better."""
        return bool(np.abs(self.N).max(initial=0.0) > STEEP)


def chart_at(
    model: Model, q: np.ndarray, v: np.ndarray, t: float, like: Chart | None = None, keep: bool = False
) -> Chart:
    """The chart at a state, with the coordinates of `like` where they still tell the motion, or in any case: `keep`.

    Raises:
        ModelError: a constraint reads a first-order state.
    """
    _, _, G, W = model.constraint_jacobian(q, v, t)
    if like is not None:
        try:
            chart = _chart(model, with_chosen(model, G, like.chosen, like.rows), W)
            if keep or not chart.steep:
                return chart
        except np.linalg.LinAlgError:
            pass
    return _chart(model, independent(model, G), W)


def chart_with(model: Model, q: np.ndarray, v: np.ndarray, t: float, chosen: np.ndarray) -> Chart:
    """The chart of given independent coordinates at a state."""
    _, _, G, W = model.constraint_jacobian(q, v, t)
    return _chart(model, with_chosen(model, G, chosen), W)


def _chart(model: Model, at: Independent, W: np.ndarray) -> Chart:
    """The chart of independent coordinates where (phi_q v)_q is W."""
    n_z, n_f = len(at.chosen), len(at.first)
    dq, dv = np.zeros((model.n_q, 2 * n_z + n_f)), np.zeros((model.n_q, 2 * n_z + n_f))
    dq[:, :n_z], dv[:, n_z : 2 * n_z] = at.N, at.N
    dv[:, :n_z] = -at.L @ (W[at.rows] @ at.N)
    dq[at.first, 2 * n_z + np.arange(n_f)] = 1.0
    return Chart(model, at.chosen, at.first, at.rows, at.N, at.L, dq, dv)


def placed(chart: Chart, x: np.ndarray, q: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """q and v on the constraints at x, from a state nearby; rates of first-order coordinates stay those given.

    Raises:
        SimulationError: there is none nearby.
    """
    model, n_z = chart.model, len(chart.chosen)
    q = q + chart.dq @ (x - chart.read(q, v))
    q[chart.chosen], q[chart.first] = x[:n_z], x[2 * n_z :]
    size = 1.0 + float(np.abs(q).max(initial=0.0))
    here = chart
    for _ in range(ITERATIONS):
        phi, _, G, W = model.constraint_jacobian(q, v, t)
        here = _chart(model, with_chosen(model, G, here.chosen, here.rows), W)
        if not np.isfinite(q).all() or not np.abs(here.N).max(initial=0.0) < np.inf:
            break
        if np.abs(phi[here.rows]).max(initial=0.0) <= CLOSED * size:
            speed = v.copy()
            speed[here.chosen] = x[n_z : 2 * n_z]
            drift = model.constraint_jacobian(q, np.zeros_like(v), t)[1][here.rows]
            moved = here.N @ x[n_z : 2 * n_z] - here.L @ drift
            speed[model.second_order] = moved[model.second_order]
            return q, speed
        q = q - here.L @ phi[here.rows]
    raise SimulationError(
        f"system '{model.system.name}': no state on the constraints lies near the corrected one at t = {t:.6g} s."
    )

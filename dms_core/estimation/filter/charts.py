"""The chart x = (z, w, s) of a state: independent coordinates, their rates, and states of first order.

    dq = N dz + (ds in its rows),    dv = N dw - L (phi_q v)_q N dz

with N, L of `analyses.independent`. A filter corrects x; `placed` goes back to q and v on the constraints, with z, w
and s kept to the last digit:  phi(q) = 0 by Newton's method along L,  v = N w - L phi_t.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from dms_core.analyses.independent import orders
from dms_core.assembly.model import Model
from dms_core.errors import SimulationError
from dms_core.linear.null_space import null_space
from dms_core.linear.rank import independent_rows

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
        """'q.<coordinate>', 'v.<coordinate>' of independent coordinates, then 'q.<state>' of first-order ones."""
        names = self.model.layout.names
        return (*(f"q.{names[k]}" for k in self.chosen), *(f"v.{names[k]}" for k in self.chosen),
                *(f"q.{names[k]}" for k in self.first))  # fmt: skip

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
    second, first = orders(model)
    if like is not None:
        try:
            chart = _with_basis(model, second, first, like.rows, like.chosen, G, W)
            if keep or not chart.steep:
                return chart
        except np.linalg.LinAlgError:
            pass
    inner = G[:, second]
    rows = independent_rows(inner).independent if model.n_phi else np.zeros(0, int)
    chosen = second[_best(null_space(inner))]
    return _with_basis(model, second, first, rows, chosen, G, W)


def chart_with(model: Model, q: np.ndarray, v: np.ndarray, t: float, chosen: np.ndarray) -> Chart:
    """The chart of given independent coordinates at a state."""
    _, _, G, W = model.constraint_jacobian(q, v, t)
    second, first = orders(model)
    rows = independent_rows(G[:, second]).independent if model.n_phi else np.zeros(0, int)
    return _with_basis(model, second, first, rows, chosen, G, W)


def _best(motions: np.ndarray) -> np.ndarray:
    """Coordinates whose motions are told apart best, by QR with column pivoting, shape (n_z,)."""
    n = motions.shape[1]
    return np.sort(la.qr(motions.T, mode="r", pivoting=True)[1][:n]) if n else np.zeros(0, int)


def _with_basis(
    model: Model, second: np.ndarray, first: np.ndarray, rows: np.ndarray, chosen: np.ndarray, G: np.ndarray,
    W: np.ndarray,
) -> Chart:  # fmt: skip
    """The chart of chosen coordinates."""
    n_z, n_f = len(chosen), len(first)
    pick = (second[None, :] == chosen[:, None]).astype(float)
    inverse = np.linalg.inv(np.vstack([G[rows][:, second], pick]))
    N, L = np.zeros((model.n_q, n_z)), np.zeros((model.n_q, len(rows)))
    L[second], N[second] = inverse[:, : len(rows)], inverse[:, len(rows) :]
    dq, dv = np.zeros((model.n_q, 2 * n_z + n_f)), np.zeros((model.n_q, 2 * n_z + n_f))
    dq[:, :n_z], dv[:, n_z : 2 * n_z] = N, N
    dv[:, :n_z] = -L @ (W[rows] @ N)
    dq[first, 2 * n_z + np.arange(n_f)] = 1.0
    return Chart(model, chosen, first, rows, N, L, dq, dv)


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
        here = _with_basis(model, *orders(model), here.rows, here.chosen, G, W)
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

"""The factorised Newton matrix at any state: solves with it and with its transpose.

    A = d(r1, r2, r3, r4) / d(q, v, lam, mu)      with qdot = c0 q + ..., vdot = c0 v + ...

over the coordinates and rows that a step solves for, evaluated and factorised by the compiled tables of the step. Rows
and unknowns are scaled there (sparsity.py),

    A_s = R A C      R = diag(1/c0, 1/c0^2, 1, 1/c0)      C = diag(1, c0, c0^2, c0)

and, as there, (phi_q^T mu)_q is left out of r1: A is exact where mu = 0, as it is on every exact solution.
"""

from __future__ import annotations

import numpy as np

from dms_core.assembly.residual import evaluate_newton
from dms_core.assembly.tables import MODEL, Tables
from dms_core.compiled.arena import Packed, inner
from dms_core.compiled.jit import compiled
from dms_core.errors import InputError, SimulationError
from dms_core.linear.lu import factor, solve, solve_transposed, storage
from dms_core.simulation.iteration.parts import SINGULAR_PIVOT


@compiled
def _solve_all(tables, a, b, x, work, transposed):
    """Row by row: x[k] of A x[k] = b[k], or of its transpose."""
    for k in range(b.shape[0]):
        if transposed:
            solve_transposed(tables, a, b[k], x[k], work)
        else:
            solve(tables, a, b[k], x[k], work)


class NewtonMatrix:
    """A factorised, at one operating point.

    Unknowns are (q, v) of `coordinates`, then (lam, mu) of `rows`; equations are (r1, r2) of `coordinates`, then (r3,
    r4) of `rows`. All numbers are in their own units: nothing is scaled outside.

    Args:
        tables: constant tables of the world, packed.
        work: work arrays that hold the point, packed; written.
        c0: leading coefficient of the method [1/s]: 1.5 / h for BDF2 at constant step, 1 / (0.2929 h) for SDIRK2.

    Raises:
        InputError: c0 is not positive and finite.
        SimulationError: the matrix is singular in the given order of elimination.
    """

    def __init__(self, tables: Packed, work: Packed, c0: float) -> None:
        if not (np.isfinite(c0) and c0 > 0.0):
            raise InputError(f"Expected a positive leading coefficient c0 [1/s], got {c0}.")
        known: Tables = tables.values
        self.c0 = float(c0)
        self.coordinates, self.rows = known.free.copy(), known.active.copy()
        self._lu = known.newton_lu
        self._factors, self._work = storage(self._lu.size), storage(self._lu.work_size)
        m = tables.table
        evaluate_newton(
            inner(m, MODEL.dynamics), inner(m, MODEL.constraints), inner(m, MODEL.newton), work.table, self.c0,
            self._factors,
        )  # fmt: skip
        self.pivot = float(factor(self._lu, self._factors, self._work)[0])
        """Smallest pivot, relative to its row: 1e-8 says that eight digits have cancelled there."""
        if not self.pivot > SINGULAR_PIVOT:
            raise SimulationError(f"the Newton matrix is singular at this state: its smallest pivot is {self.pivot}.")
        n, k = len(self.coordinates), len(self.rows)
        self._row_scale = np.repeat([1.0 / c0, 1.0 / c0**2, 1.0, 1.0 / c0], [n, n, k, k])
        self._unknown_scale = np.repeat([1.0, c0, c0**2, c0], [n, n, k, k])

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self._row_scale)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """x of A x = b, shape (size,) or several right-hand sides as columns, (size, k)."""
        return self._solved(b, self._row_scale, self._unknown_scale, False)

    def solve_transposed(self, b: np.ndarray) -> np.ndarray:
        """x of A^T x = b; shapes as in `solve`."""
        return self._solved(b, self._unknown_scale, self._row_scale, True)

    def _solved(self, b: np.ndarray, before: np.ndarray, behind: np.ndarray, transposed: bool) -> np.ndarray:
        b = np.asarray(b, float)
        if b.ndim not in (1, 2) or len(b) != self.size:
            raise InputError(f"Expected right-hand sides of shape ({self.size},) or ({self.size}, k), got {b.shape}.")
        columns = np.ascontiguousarray(before * np.atleast_2d(b.T))
        x = np.empty_like(columns)
        _solve_all(self._lu, self._factors, columns, x, self._work, transposed)
        x *= behind
        return x[0] if b.ndim == 1 else np.ascontiguousarray(x.T)

    def equations(self, r1: np.ndarray, r2: np.ndarray, r3: np.ndarray, r4: np.ndarray) -> np.ndarray:
        """A right-hand side from residual blocks over all coordinates and rows; further axes are columns."""
        return np.concatenate([r1[self.coordinates], r2[self.coordinates], r3[self.rows], r4[self.rows]])

    def parts(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Shares of x that belong to (q, v) of `coordinates` and (lam, mu) of `rows`."""
        n, k = len(self.coordinates), len(self.rows)
        q, v, lam, mu = np.split(x, [n, 2 * n, 2 * n + k])
        return q, v, lam, mu

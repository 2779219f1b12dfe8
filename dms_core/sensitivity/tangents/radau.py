"""The implicit function theorem at a step of Radau IIA: its three stages at once.

With w_ij = (A^-1)_ij / h and w_i their sum over j, stage i is qdot_i = sum_j w_ij q_j - w_i q_n, vdot_i likewise. The
matrix of all stages, each with derivatives of its own, is factorised by SuperLU; Newton's method of a step does with
the derivatives of one. The step ends with its last stage, on the constraints.

    stage i by stage j /= i:   r1: -w_ij dq_j       r2: r2_a w_ij dv_j
    by the begin:              r1: +w_i dq_n        r2: -r2_a w_i dv_n
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from dms_core.assembly.derivatives.blocks import Blocks, OperatingPoint
from dms_core.sensitivity.nodes import Number, by_numbers
from dms_core.sensitivity.tangents.tables import Adjoints, Columns
from dms_core.simulation.dynamics import World
from dms_core.simulation.iteration.implicit_stage import set_weights
from dms_core.simulation.iteration.newton import NEWTON
from dms_core.simulation.iteration.parts import run_radau5, set_inputs
from dms_core.simulation.methods.radau_constants import A_INVERSE, STAGES, C
from dms_core.simulation.state import CLOCK, COUNTS

PASSES = 12
ROUNDING = 1e-9
"""Such a correction behind which one more is taken, and no other."""
CLOSE = 1e-13
"""Largest correction of a stage, over 1 + its size, behind which the matrix is taken at the stage."""
LAST = STAGES - 1


class RadauStep:
    """One differentiated step.

    Args:
        world: whose state is the begin of the step; its q, v become those of the end.
        numbers: declared numbers to differentiate by.
        h: size of the step [s].
    """

    def __init__(self, world: World, numbers: Sequence[Number], h: float) -> None:
        self._world, self._numbers, self._h = world, numbers, h
        tables = world.tables.values
        self._free, self._active = tables.free, tables.active
        n, k = len(self._free), len(self._active)
        self._n, self._size = n, 2 * n + 2 * k
        self._w = np.array(A_INVERSE) / h
        # Rows and unknowns are scaled as in sparsity.py, with c0 = 1 / h.
        self._of_rows = np.tile(np.repeat([h, h * h, 1.0, h], [n, n, k, k]), STAGES)[:, None]
        self._of_unknowns = np.tile(np.repeat([1.0, 1.0 / h, 1.0 / h**2, 1.0 / h], [n, n, k, k]), STAGES)[:, None]
        self.solved = self._solve_stages() and self._polish()
        if self.solved:
            s = world.state
            s.q[:], s.v[:] = self._q[LAST], self._v[LAST]

    def _solve_stages(self) -> bool:
        """The method's own iteration, from no past."""
        world = self._world
        s, o = world.state, world.options.numbers()._replace(fixed_step=self._h)
        self._q0, self._v0 = s.q.copy(), s.v.copy()
        s.counts[COUNTS.restart] = 1
        tables = world.tables.table, world.packed.table
        set_weights(*tables, o)
        code, _, _ = run_radau5(*tables, o, self._h)
        s.counts[COUNTS.restart] = 0
        stages: Any = s.radau.values
        self._q, self._v, self._lam, self._mu = (x.copy() for x in (stages.q, stages.v, stages.lam, stages.mu))
        if code != NEWTON.converged:
            # Newton's method with the derivatives of every stage gets farther than that with those of one.
            share = self._h * np.array(C)[:, None]
            self._q, self._v = self._q0 + share * self._v0, self._v0 + share * s.vd
            self._lam, self._mu = np.tile(s.lam, (STAGES, 1)), np.zeros_like(self._mu)
        return bool(np.isfinite(self._q).all())

    def _point(self, i: int) -> OperatingPoint:
        """Stage i."""
        world, w = self._world, self._w
        s, t = world.state, float(world.state.clock[CLOCK.t])
        set_inputs(world.tables.table, world.packed.table, t + C[i] * self._h, True)
        u = s.w.u.copy()
        world.model.layout.put_driven(u[:, 0], self._v[i])
        qdot, a = w[i] @ (self._q - self._q0), w[i] @ (self._v - self._v0)
        return OperatingPoint(self._q[i].copy(), qdot, self._v[i].copy(), a, self._lam[i], self._mu[i], u)

    def _polish(self) -> bool:
        """Newton's method on all stages, each with its own derivatives; keeps the factors of the last matrix."""
        n, k, free, active = self._n, len(self._active), self._free, self._active
        before = np.inf
        for _ in range(PASSES):
            self._points = [self._point(i) for i in range(STAGES)]
            self._blocks = [self._world.model.derivatives.blocks(p) for p in self._points]
            try:
                scaled = sp.diags_array(self._of_rows[:, 0]) @ self._matrix() @ sp.diags_array(self._of_unknowns[:, 0])
                self._lu = spla.splu(sp.csc_array(scaled))
            except RuntimeError:
                return False
            rows = [np.concatenate([b.r1[free], b.r2[free], b.r3[active], b.r4[active]]) for b in self._blocks]
            x = -self._solved(np.concatenate(rows)[:, None]).reshape(STAGES, self._size)
            if not np.isfinite(x).all():
                return False
            self._q[:, free] += x[:, :n]
            self._v[:, free] += x[:, n : 2 * n]
            self._lam[:, active] += x[:, 2 * n : 2 * n + k]
            self._mu[:, active] += x[:, 2 * n + k :]
            left = np.abs(x[:, :n] / (1.0 + np.abs(self._q[:, free]))).max(initial=0.0)
            if left < CLOSE or before < ROUNDING:
                break
            before = left
        else:
            return False
        self._r_u = [np.concatenate([0.0 * b.r2_u[free], b.r2_u[free], b.r3_u[active], b.r4_u[active]])[:, :, 0]
                     for b in self._blocks]  # fmt: skip
        self._r_p = [self._by_numbers(p) for p in self._points]
        return True

    def _solved(self, b: np.ndarray, transposed: bool = False) -> np.ndarray:
        """x of the system of all stages, or of its transpose; columns are right-hand sides."""
        before, behind = (self._of_unknowns, self._of_rows) if transposed else (self._of_rows, self._of_unknowns)
        return behind * self._lu.solve(before * b, trans="T" if transposed else "N")

    def _by_numbers(self, point: OperatingPoint) -> np.ndarray:
        """Rows of a stage by the declared numbers, shape (size, n_p)."""
        known, free, active = by_numbers(self._world.model, self._numbers, point), self._free, self._active
        rows = [np.concatenate([p.r1[free], p.r2[free], p.r3[active], p.r4[active]]) for p in known]
        return np.column_stack([np.zeros((self._size, 0)), *rows])

    def _mass(self, b: Blocks) -> sp.csr_array:
        return b.r2_a[self._free][:, self._free]

    def _matrix(self) -> sp.csc_array:
        """All stages by all stages."""
        n, w, N = self._n, self._w, len(self._world.state.q)
        phi = 2 * N + np.arange(self._world.model.n_phi)
        kept = np.concatenate([self._free, N + self._free, phi[self._active],
                               phi[self._active] + self._world.model.n_phi])  # fmt: skip
        blocks: list[list[Any]] = [[None] * STAGES for _ in range(STAGES)]
        rest, one = self._size - 2 * n, sp.eye_array(n)
        for i, b in enumerate(self._blocks):
            mass = self._mass(b)
            for j in range(STAGES):
                if i == j:
                    blocks[i][j] = b.newton(w[i, i])[kept][:, kept]
                else:
                    parts = [-w[i, j] * one, w[i, j] * mass, sp.csr_array((rest, rest))]
                    blocks[i][j] = sp.block_diag(parts)
        return sp.csc_array(sp.block_array(blocks))

    def forward(self, c: Columns) -> None:
        """The columns from the begin to the end."""
        n, free, parts = self._n, self._free, []
        for i, b in enumerate(self._blocks):
            r = np.zeros((self._size, len(c.dq)))
            w = self._w[i].sum()
            r[:n] = -w * c.dq[:, free].T
            r[n : 2 * n] = w * (self._mass(b) @ c.dv[:, free].T)
            r -= self._r_u[i] @ c.du[len(c.dq) :, ::3].T
            moved = c.parameter >= 0
            r[:, moved] -= self._r_p[i][:, c.parameter[moved]]
            parts.append(r)
        x = self._solved(np.concatenate(parts)).reshape(STAGES, self._size, -1)[LAST]
        c.dq[:, free], c.dv[:, free] = x[:n].T, x[n : 2 * n].T

    def back(self, a: Adjoints) -> None:
        """The adjoints from the end to the begin; inputs and numbers are added up."""
        n, free = self._n, self._free
        g = np.zeros((STAGES, self._size, len(a.aq)))
        g[LAST, :n], g[LAST, n : 2 * n] = a.aq[:, free].T, a.av[:, free].T
        x = self._solved(g.reshape(STAGES * self._size, -1), True).reshape(STAGES, self._size, -1)
        a.aq[:, free], a.av[:, free] = 0.0, 0.0
        for i, b in enumerate(self._blocks):
            w = self._w[i].sum()
            a.aq[:, free] -= w * x[i, :n].T
            a.av[:, free] += w * (self._mass(b).T @ x[i, n : 2 * n]).T
            a.au[:, ::3] -= x[i].T @ self._r_u[i]
            a.ap[:] -= x[i].T @ self._r_p[i]

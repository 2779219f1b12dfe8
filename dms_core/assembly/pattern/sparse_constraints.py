"""phi_q of all constraints as a sparse matrix: what a start is assembled with where a dense one would be too large."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from dms_core.assembly.layout import Layout
from dms_core.assembly.local import evaluate_constraint, put_constraint_values, views
from dms_core.compiled.arena import Packed
from dms_core.compiled.jit import compiled


@compiled
def constraint_entries(constraints, w, values):
    """phi, phi_q v + phi_t, and the local phi_q of one call behind the other, row by row."""
    x, at = views(constraints, w), 0
    for e in range(x.kernel.shape[0]):
        n = evaluate_constraint(x, constraints, e, w, 0)
        put_constraint_values(x, e, n)
        for k in range(x.row[e + 1] - x.row[e]):
            for i in range(n):
                values[at] = x.G[k, i]
                at += 1


class SparseConstraints:
    """Places of the entries of phi_q.

    Args:
        layout: the system, laid out.
        constraints: its constraint calls, packed.
    """

    def __init__(self, layout: Layout, constraints: Packed) -> None:
        self._constraints, self._shape = constraints, (layout.n_phi, layout.n_q + 7)
        calls = layout.constraints
        rows = [np.repeat(np.arange(c.row, c.row + c.rows), len(c.iq)) for c in calls]
        columns = [np.tile(c.iq, c.rows) for c in calls]
        none = np.zeros(0, int)
        self._rows, self._columns = np.concatenate([none, *rows]), np.concatenate([none, *columns])

    def __call__(self, w: Packed) -> sp.csr_array:
        """phi_q at the state in the work arrays, into which phi and phi_q v + phi_t are written, (n_phi, n_q)."""
        values = np.zeros(len(self._rows))
        constraint_entries(self._constraints.table, w.table, values)
        G = sp.csr_array((values, (self._rows, self._columns)), shape=self._shape)
        return G[:, : self._shape[1] - 7]

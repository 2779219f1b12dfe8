"""Bodies welded to the ground: left out of the equations of a step, their reactions found when they are read.

A body that fixed joints join to the ground, itself or through others, cannot move. Its coordinates are constants, and
the rows of its joints and norms hold by themselves; both are left out of the linear systems of a step. The multipliers
of those rows follow from the rows of r2 that were left out,

    (phi_q^T lam)_welded = -r2_welded      with the other multipliers in r2,

whose matrix is constant.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from dms_core.assembly.layout import Layout
from dms_core.assembly.readings.sensing import SENSING, put_state
from dms_core.assembly.residual import evaluate_residual
from dms_core.assembly.tables import WORK
from dms_core.compiled.arena import fields, floats, indices, inner, matrix
from dms_core.compiled.jit import compiled
from dms_core.model.element import GROUND


class Welds(NamedTuple):
    """What does not move, for compiled code."""

    free: np.ndarray
    """Coordinates that are solved for."""
    solved: np.ndarray
    """Independent constraint rows that are solved for."""
    coordinates: np.ndarray
    """Coordinates of welded bodies."""
    rows: np.ndarray
    """Independent rows among welded bodies and the ground, as many as `coordinates`."""
    inverse: np.ndarray
    """Inverse of phi_q^T restricted to these rows and coordinates."""


WELDS = fields(Welds)


def find_welds(layout: Layout, active: np.ndarray, G: np.ndarray | sp.csr_array) -> Welds:
    """Bodies that are fixed to the ground; none where joints do not hold them exactly once, or where all are fixed.

    Args:
        layout: the system, laid out.
        active: independent constraint rows.
        G: phi_q at the start, shape (n_phi, n_q).
    """
    free = np.arange(layout.n_q)
    nothing = np.zeros(0, int)
    none = Welds(free.astype(np.int32), np.asarray(active, np.int32), nothing, nothing, np.zeros((0, 0)))
    names = _fixed_bodies(layout)
    if not names:
        return none
    welded = np.sort(np.concatenate([layout.body_indices(name) for name in names]))
    held = np.isin(np.arange(layout.n_q + 7), [*welded, *range(layout.n_q, layout.n_q + 7)])
    among = [c for c in layout.constraints if held[c.iq].all()]
    rows = np.concatenate([np.arange(c.row, c.row + c.rows) for c in among])
    rows = rows[np.isin(rows, active)]
    if len(rows) != len(welded) or len(welded) == layout.n_q or any(len(c.iu) for c in among):
        return none
    block = G[rows][:, welded]
    inverse = np.linalg.inv((block.toarray() if sp.issparse(block) else block).T)
    solved = np.setdiff1d(active, rows)
    return Welds(
        np.setdiff1d(free, welded).astype(np.int32), solved.astype(np.int32), welded.astype(np.int32),
        rows.astype(np.int32), np.ascontiguousarray(inverse),
    )  # fmt: skip


def _fixed_bodies(layout: Layout) -> set[str]:
    """Bodies that a chain of welds joins to the ground."""
    welds = [set(c.welded()) for c in layout.system.constraints]
    found, size = {GROUND}, 0
    while len(found) > size:
        size = len(found)
        for bodies in welds:
            if bodies & found:
                found |= bodies
    return found - {GROUND}


@compiled
def recover(sensing, welds, signals, t, q, v, a, lam, behind):
    """Fill in lam[k] of the rows that were left out, at the states q[k], v[k], a[k] and times t[k]."""
    w, rows = inner(sensing, SENSING.work), indices(welds, WELDS.rows)
    coordinates, inverse, r2 = indices(welds, WELDS.coordinates), matrix(welds, WELDS.inverse), floats(w, WORK.r2)
    for k in range(t.shape[0]):
        for i in range(rows.shape[0]):
            lam[k, rows[i]] = 0.0
        put_state(w, signals, t[k], q[k], v[k], a[k], lam[k], behind[k])
        evaluate_residual(inner(sensing, SENSING.dynamics), inner(sensing, SENSING.constraints), w)
        for i in range(rows.shape[0]):
            total = 0.0
            for j in range(rows.shape[0]):
                total -= inverse[i, j] * r2[coordinates[j]]
            lam[k, rows[i]] = total

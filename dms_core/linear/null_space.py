"""Independent coordinates: an orthonormal basis of the velocities that the constraints allow."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from dms_core.linear.rank import RANK_TOLERANCE, independent_rows


def null_space(G: np.ndarray, tol: float = RANK_TOLERANCE) -> np.ndarray:
    """N with G N = 0 and N^T N = I, shape (n, n - rank(G)): dq = N dz for independent coordinates z.

    N is the last n - rank columns of Q in the Householder QR of G_i^T, G_i being a largest set of independent rows
    (`independent_rows`, so that redundant rows change nothing). Columns of G that are zero, the coordinates that no
    constraint sees, are among the unit directions that N spans. The basis is one of many: any N R with R orthogonal is
    another, and two neighbouring states may give bases that are turned against each other; turn with R = N_2^T N_1.
    Lengths and Euler parameters are measured alike, as they stand in q.

    Args:
        G: phi_q, shape (m, n); m = 0 is allowed, and gives the identity.
        tol: relative tolerance of the rank.
    """
    rows = independent_rows(G, tol).independent
    if not len(rows):
        return np.eye(np.shape(G)[1])
    length = np.linalg.norm(G[rows], axis=1)
    Q = la.qr((G[rows] / length[:, None]).T, mode="full")[0]
    return np.ascontiguousarray(Q[:, len(rows) :])

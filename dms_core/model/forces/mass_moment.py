"""Load per mass on a body whose mass is not all at its r: force times distance that the mass has about it.

With the first moment of mass c(eta) = c_0 + P eta about r, in body axes, eta the body's further coordinates, a load of
g per mass in ground axes does the work g . (m r + A c), so that, besides m g on r,

    Q_p = (d(A c)/dp)^T g,   Q_eta = P^T A^T g

A load that turns with the body has g = A g_b. The numbers are c_0, then the columns of P.
"""

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import add_hessian, columns, combination, dot, rotated, vec


@compiled
def first_moment(par, at, k, q):
    """c(eta) in body axes; numbers from `at`, k further coordinates."""
    return combination(vec(par, at), par, at + 3, 3, k, q, 7)


@compiled
def add_moment_load(par, at, k, g, q, level, r, Jq):
    """Rows and derivatives of the fixed load g per mass, but for the force on r."""
    c = first_moment(par, at, k, q)
    d = columns(q, 0, c)
    for n in range(4):
        r[3 + n] -= dot(d[n], g)
    for n in range(k):
        P = vec(par, at + 3 + 3 * n)
        r[7 + n] -= dot(rotated(q, 0, P), g)
        if level > 0:
            by_p = columns(q, 0, P)
            for i in range(4):
                Jq[7 + n, 3 + i] -= dot(by_p[i], g)
                Jq[3 + i, 7 + n] -= dot(by_p[i], g)
    if level > 0:
        add_hessian(Jq, 0, g, c, -1.0)


@compiled
def add_following(par, at, k, g_b, q, Jq):
    """What the turning of g = A g_b adds to the derivatives of `add_moment_load`."""
    turning, d = columns(q, 0, g_b), columns(q, 0, first_moment(par, at, k, q))
    for i in range(4):
        for n in range(4):
            Jq[3 + n, 3 + i] -= dot(d[n], turning[i])
        for n in range(k):
            Jq[7 + n, 3 + i] -= dot(rotated(q, 0, vec(par, at + 3 + 3 * n)), turning[i])


def moment_pattern(k: int) -> np.ndarray:
    """Where the derivatives of `add_moment_load` may be non-zero, k further coordinates."""
    by_q = np.zeros((7 + k, 7 + k), bool)
    by_q[3:7, 3:] = by_q[3:, 3:7] = True
    return by_q

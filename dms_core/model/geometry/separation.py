"""Half the squared distance of two points on two bodies, with its derivatives: one geometry for rods and springs.

    e = d . d / 2,   d = r_i + A_i s_i - r_j - A_j s_j,   C = d_q (3 x 14)
    e_q = d^T C,     e_qq = C^T C + sum_m d_m (d_m)_qq

Unlike the distance itself it is smooth everywhere. Body i stands at local offset 0, body j at 7.
"""

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import (
    add_cross_hessian,
    add_hessian,
    columns,
    euler_parameters,
    k_times,
    point,
    point_rate,
    sub,
)

BODY_I, BODY_J = 0, 7


@compiled
def separation(s_i, s_j, q):
    """d: from the point of body j to the point of body i, ground axes [m]."""
    return sub(point(q, BODY_I, s_i), point(q, BODY_J, s_j))


@compiled
def separation_rate(s_i, s_j, q, v):
    """C v [m/s]."""
    return sub(point_rate(q, v, BODY_I, s_i), point_rate(q, v, BODY_J, s_j))


@compiled
def _row(w, g, h):
    """The 14-tuple (w, 2 g, -w, -2 h)."""
    return (
        w[0], w[1], w[2], 2.0 * g[0], 2.0 * g[1], 2.0 * g[2], 2.0 * g[3],
        -w[0], -w[1], -w[2], -2.0 * h[0], -2.0 * h[1], -2.0 * h[2], -2.0 * h[3],
    )  # fmt: skip


@compiled
def separation_gradient(s_i, s_j, q, d):
    """d^T C for any vector d held fixed, as a 14-tuple; with the separation itself it is e_q."""
    return _row(d, k_times(d, s_i, euler_parameters(q, BODY_I)), k_times(d, s_j, euler_parameters(q, BODY_J)))


@compiled
def separation_rate_gradient(s_i, s_j, q, v):
    """(e_q v)_q = e_qq v, as a 14-tuple: d^T C_qq v + (C v)^T C."""
    d, d_t = separation(s_i, s_j, q), separation_rate(s_i, s_j, q, v)
    g = _plus(k_times(d, s_i, euler_parameters(v, BODY_I)), k_times(d_t, s_i, euler_parameters(q, BODY_I)))
    h = _plus(k_times(d, s_j, euler_parameters(v, BODY_J)), k_times(d_t, s_j, euler_parameters(q, BODY_J)))
    return _row(d_t, g, h)


@compiled
def _plus(x, y):
    """Sum of two 4-tuples."""
    return (x[0] + y[0], x[1] + y[1], x[2] + y[2], x[3] + y[3])


@compiled
def add_separation_hessian(s_i, s_j, q, factor, H):
    """H[:, :] += factor e_qq."""
    d = separation(s_i, s_j, q)
    c_i, c_j = columns(q, BODY_I, s_i), columns(q, BODY_J, s_j)
    for m in range(3):
        for x, y, sign in (
            (BODY_I, BODY_I, 1.0),
            (BODY_J, BODY_J, 1.0),
            (BODY_I, BODY_J, -1.0),
            (BODY_J, BODY_I, -1.0),
        ):
            H[x + m, y + m] += sign * factor
        for n in range(4):
            # Rows of r_i carry (c_i, -c_j), rows of r_j their opposite; then the transposed entries.
            for x, sign in ((BODY_I, factor), (BODY_J, -factor)):
                H[x + m, BODY_I + 3 + n] += sign * c_i[n][m]
                H[BODY_I + 3 + n, x + m] += sign * c_i[n][m]
                H[x + m, BODY_J + 3 + n] -= sign * c_j[n][m]
                H[BODY_J + 3 + n, x + m] -= sign * c_j[n][m]
    # add_cross_hessian writes the product and its transpose: half of it where both blocks are one body's.
    add_cross_hessian(H, q, BODY_I, s_i, BODY_I, s_i, 0.5 * factor)
    add_cross_hessian(H, q, BODY_J, s_j, BODY_J, s_j, 0.5 * factor)
    add_cross_hessian(H, q, BODY_I, s_i, BODY_J, s_j, -factor)
    add_hessian(H, BODY_I, d, s_i, factor)
    add_hessian(H, BODY_J, d, s_j, -factor)


def separation_pattern(s_i, s_j) -> tuple[np.ndarray, np.ndarray]:
    """Where e_q and e_qq can be non-zero, shapes (14,) and (14, 14): a point at the centre of mass does not turn."""
    turn_i, turn_j = bool(np.any(s_i)), bool(np.any(s_j))
    row = np.array([True] * 3 + [turn_i] * 4 + [True] * 3 + [turn_j] * 4)
    H = np.outer(row, row)
    for x in (BODY_I, BODY_J):
        for y in (BODY_I, BODY_J):
            H[x : x + 3, y : y + 3] = np.eye(3, dtype=bool)
    return row, H

"""The three scalar equations of which every joint between two bodies is made, with all derivatives.

    coincidence   r_i + A_i s_i - r_j - A_j s_j = 0     three rows           (spherical joint, eq. 10)
    dot1          (A_i a) . (A_j b) = c                 one row              (perpendicular directions for c = 0)
    dot2          (A_i a) . (r_j + A_j s_j - r_i - A_i s_i) = 0   one row    (a point stays in a plane)

Names and forms as in Haug (1989), sect. 9.4. Each adds row k of phi, G = phi_q, W = (phi_q v)_q and its share of
H = (phi_q^T lam)_q for the bodies at local offsets oi and oj.
"""

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.model.element import ConstraintPattern
from dms_core.model.geometry.rotations import (
    add_cross_hessian,
    add_gradient,
    add_hessian,
    add_row_hessian,
    columns,
    dot,
    point,
    point_rate,
    rotated,
    rotated_rate,
    sub,
)


@compiled
def coincidence(k, oi, oj, si, sj, q, v, lam, level, phi, G, W, H):
    """Rows k, k+1, k+2: the points s_i and s_j coincide [m]."""
    d = sub(point(q, oi, si), point(q, oj, sj))
    ci, cj = columns(q, oi, si), columns(q, oj, sj)
    for m in range(3):
        phi[k + m] = d[m]
        G[k + m, oi + m] += 1.0
        G[k + m, oj + m] -= 1.0
        for n in range(4):
            G[k + m, oi + 3 + n] += ci[n][m]
            G[k + m, oj + 3 + n] -= cj[n][m]
    if level > 0:
        w = (lam[k], lam[k + 1], lam[k + 2])
        add_hessian(H, oi, w, si, 1.0)
        add_hessian(H, oj, w, sj, -1.0)
        # A s is a quadratic form of p: its gradient at pdot is (d(A s)/dp pdot)_p.
        ci, cj = columns(v, oi, si), columns(v, oj, sj)
        for m in range(3):
            for n in range(4):
                W[k + m, oi + 3 + n] += ci[n][m]
                W[k + m, oj + 3 + n] -= cj[n][m]


@compiled
def dot1(k, oi, oj, a, b, c, q, v, lam, level, phi, G, W, H):
    """Row k: the directions a of body i and b of body j keep their scalar product c [-]."""
    f, g = rotated(q, oi, a), rotated(q, oj, b)
    phi[k] = dot(f, g) - c
    add_gradient(G, k, oi, q, g, a, 1.0)
    add_gradient(G, k, oj, q, f, b, 1.0)
    if level > 0:
        add_hessian(H, oi, g, a, lam[k])
        add_hessian(H, oj, f, b, lam[k])
        add_cross_hessian(H, q, oi, a, oj, b, lam[k])
        add_row_hessian(W, k, oi, v, g, a, 1.0)
        add_row_hessian(W, k, oj, v, f, b, 1.0)
        add_gradient(W, k, oi, q, rotated_rate(q, v, oj, b), a, 1.0)
        add_gradient(W, k, oj, q, rotated_rate(q, v, oi, a), b, 1.0)


@compiled
def dot2(k, oi, oj, a, si, sj, q, v, lam, level, phi, G, W, H):
    """Row k: point s_j of body j stays in the plane through s_i of body i with normal a [m]."""
    f = rotated(q, oi, a)
    d = sub(point(q, oj, sj), point(q, oi, si))
    phi[k] = dot(f, d)
    for m in range(3):
        G[k, oj + m] += f[m]
        G[k, oi + m] -= f[m]
    add_gradient(G, k, oi, q, d, a, 1.0)
    add_gradient(G, k, oi, q, f, si, -1.0)
    add_gradient(G, k, oj, q, f, sj, 1.0)
    if level > 0:
        dot2_second(k, oi, oj, a, si, sj, q, v, lam[k], f, d, W, H)


@compiled
def dot2_second(k, oi, oj, a, si, sj, q, v, lam, f, d, W, H):
    """Second derivatives of dot2."""
    ca = columns(q, oi, a)
    f_t = rotated_rate(q, v, oi, a)
    d_t = sub(point_rate(q, v, oj, sj), point_rate(q, v, oi, si))
    for n in range(4):
        W[k, oi + 3 + n] += dot(ca[n], d_t)
        for m in range(3):
            h = lam * ca[n][m]
            H[oi + 3 + n, oj + m] += h
            H[oj + m, oi + 3 + n] += h
            H[oi + 3 + n, oi + m] -= h
            H[oi + m, oi + 3 + n] -= h
    for m in range(3):
        W[k, oj + m] += f_t[m]
        W[k, oi + m] -= f_t[m]
    add_row_hessian(W, k, oi, v, d, a, 1.0)
    add_row_hessian(W, k, oi, v, f, si, -1.0)
    add_row_hessian(W, k, oj, v, f, sj, 1.0)
    add_gradient(W, k, oi, q, f_t, si, -1.0)
    add_gradient(W, k, oj, q, f_t, sj, 1.0)
    add_hessian(H, oi, d, a, lam)
    add_hessian(H, oi, f, si, -lam)
    add_hessian(H, oj, f, sj, lam)
    add_cross_hessian(H, q, oi, a, oi, si, -lam)
    add_cross_hessian(H, q, oi, a, oj, sj, lam)


def joint_pattern(rows: str) -> ConstraintPattern:
    """Pattern of a two-body joint from its rows: 'c' one of a coincidence (in order x, y, z), '1' dot1, '2' dot2."""
    m, n = len(rows), 14
    G, W = np.zeros((m, n), bool), np.zeros((m, n), bool)
    H = np.zeros((n, n), bool)
    p = np.r_[3:7, 10:14]
    H[np.ix_(p, p)] = True
    if set(rows) == {"c"}:
        H[3:7, 10:14] = H[10:14, 3:7] = False
    axis = 0
    for k, row in enumerate(rows):
        G[k, p] = W[k, p] = True
        if row == "c":
            G[k, [axis, 7 + axis]] = True
            axis = (axis + 1) % 3
        if row == "2":
            r = np.r_[0:3, 7:10]
            G[k, r] = W[k, r] = True
            H[np.ix_(r, np.r_[3:7])] = H[np.ix_(np.r_[3:7], r)] = True
    return ConstraintPattern(G, W, H)

"""Consistent mass of a beam element: that of the cubic through both sections (Hermite), large rotations included.

    r(s) = H1 r_i + H2 L t_i + H3 r_j + H4 L t_j,   t = A e_1,   X = (r_i, L t_i, r_j, L t_j)
    T = 1/2 int rho A |rdot|^2 ds = 1/2 Xdot^T (M x I) Xdot,   M = rho A L / 420 (156 22 54 -13; 22 4 13 -3; ...)

M is constant (J. S. Przemieniecki (1968), Theory of Matrix Structural Analysis, sect. 11.3); with X_tt at hand the rows
are X_q^T (M x I) X_tt. The nodes are rigid bodies with half the element's mass each, which is taken off M here; the
rotary inertia of the sections stays at the nodes.
"""

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import add_hessian, columns, dot, rotated_rate, scale, vec

E1 = (1.0, 0.0, 0.0)
OFFSETS = (0, 7)
POSITIONS = ((-54.0, 54.0), (54.0, -54.0))
"""420 / rho A L times the part of M between r_i, r_j and r_i, r_j, less the nodes' 210."""
MIXED = ((22.0, -13.0), (13.0, -22.0))
"""Likewise between r_i, r_j and L t_i, L t_j."""
TANGENTS = ((4.0, -3.0), (-3.0, 4.0))
"""Likewise between L t_i, L t_j and L t_i, L t_j."""


@compiled
def tangent_acceleration(q, v, a, o, length):
    """Second time derivative of L A e_1 of the section at offset o."""
    c, p = columns(q, o, E1), (a[o + 3], a[o + 4], a[o + 5], a[o + 6])
    w = rotated_rate(v, v, o, E1)
    return (
        length * (c[0][0] * p[0] + c[1][0] * p[1] + c[2][0] * p[2] + c[3][0] * p[3] + w[0]),
        length * (c[0][1] * p[0] + c[1][1] * p[1] + c[2][1] * p[2] + c[3][1] * p[3] + w[1]),
        length * (c[0][2] * p[0] + c[1][2] * p[1] + c[2][2] * p[2] + c[3][2] * p[3] + w[2]),
    )


@compiled
def weighted(x, a, y, b):
    """x a + y b for triples a, b."""
    return (x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2])


@compiled
def add_beam_mass(share, length, q, v, a, level, r, Jq, Jv, Ja):
    """Rows of the element's mass less the nodes'; `share` is rho A L / 420."""
    r_i, r_j = vec(a, 0), vec(a, 7)
    t_i, t_j = tangent_acceleration(q, v, a, 0, length), tangent_acceleration(q, v, a, 7, length)
    for b in range(2):
        o = OFFSETS[b]
        one = weighted(POSITIONS[b][0], r_i, POSITIONS[b][1], r_j)
        two = weighted(MIXED[b][0], t_i, MIXED[b][1], t_j)
        f = weighted(share, one, share, two)
        one = weighted(MIXED[0][b], r_i, MIXED[1][b], r_j)
        two = weighted(TANGENTS[b][0], t_i, TANGENTS[b][1], t_j)
        w = weighted(share * length, one, share * length, two)
        c = columns(q, o, E1)
        for i in range(3):
            r[o + i] += f[i]
        for n in range(4):
            r[o + 3 + n] += dot(c[n], w)
        if level > 0:
            add_hessian(Jq, o, w, E1, 1.0)
    if level > 0:
        for b in range(2):
            _mass_columns(share, length, b, q, v, a, Jq, Jv, Ja)


@compiled
def _mass_columns(share, length, b, q, v, a, Jq, Jv, Ja):
    """Derivatives by position and Euler parameters of section b, but for the curvature of its own tangent."""
    column = OFFSETS[b]
    by_q, by_v, by_a = columns(a, column, E1), columns(v, column, E1), columns(q, column, E1)
    for k in range(2):
        row, c = OFFSETS[k], columns(q, OFFSETS[k], E1)
        for i in range(3):
            Ja[row + i, column + i] += share * POSITIONS[k][b]
        mixed, turned = share * length * MIXED[k][b], share * length * MIXED[b][k]
        tangents = share * length * length * TANGENTS[k][b]
        for n in range(4):
            for i in range(3):
                Jq[row + i, column + 3 + n] += mixed * by_q[n][i]
                Jv[row + i, column + 3 + n] += 2.0 * mixed * by_v[n][i]
                Ja[row + i, column + 3 + n] += mixed * by_a[n][i]
                Ja[row + 3 + n, column + i] += turned * c[n][i]
            x, y, z = scale(tangents, by_q[n]), scale(2.0 * tangents, by_v[n]), scale(tangents, by_a[n])
            for i in range(4):
                Jq[row + 3 + i, column + 3 + n] += dot(c[i], x)
                Jv[row + 3 + i, column + 3 + n] += dot(c[i], y)
                Ja[row + 3 + i, column + 3 + n] += dot(c[i], z)

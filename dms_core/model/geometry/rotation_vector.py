"""The rotation vector between two frames on two bodies, with its first and second derivatives.

    x = conj(P) Q,   P = p_i c_i,   Q = p_j c_j        Euler parameters of frame j in frame i, scalar c first, then e
    phi = g e,   g = 2 atan2(n, c) / n,   n = |e|      rotation vector [rad], the same in both frames

c_i and c_j are the frames' constant Euler parameters in their bodies. The rotation is taken the short way round, with
c >= 0: |phi| stays below pi. x is linear in the Euler parameters of each body, and g depends on c and s = n^2 only:

    g_c = -2 / D,   g_s = (c / D - g / 2) / s,   D = c^2 + s
    g_cc = 4 c / D^2,   g_cs = 2 / D^2,   g_ss = -(c / D^2 + 3/2 g_s) / s

with series in s / c^2 where the rotation is small. Rotations as in J. Argyris (1982), Comput. Methods Appl. Mech. Eng.
32:85-155.
"""

import math

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.quaternions import PARAMETERS, conjugate, inner4, product, scaled4, sum4
from dms_core.model.geometry.rotations import dot, euler_parameters

SMALL = 0.05
"""s / c^2 below which series are summed. Above, g_ss has lost 1e-16 / SMALL^2 = 4e-14 of itself."""
TERMS = 14
"""Of the series: what is left out is SMALL^14 = 6e-19 of the first."""


@compiled
def relative_parameters(p, ci, s, cj):
    """conj(p ci) (s cj) for 4-tuples p of body i and s of body j: linear in each."""
    return product(conjugate(product(p, ci)), product(s, cj))


@compiled
def short_way(q, oi, oj, ci, cj):
    """(x, sign): x with c >= 0, and the sign that makes it so."""
    x = relative_parameters(euler_parameters(q, oi), ci, euler_parameters(q, oj), cj)
    sign = 1.0 if x[0] >= 0.0 else -1.0
    return scaled4(sign, x), sign


@compiled
def _slopes(x):
    """(g, g_c, g_s, g_cc, g_cs, g_ss)."""
    c, s = x[0], x[1] * x[1] + x[2] * x[2] + x[3] * x[3]
    D = c * c + s
    if s < SMALL * c * c:
        z, power = -s / (c * c), 1.0
        g, g_s, g_ss = 1.0, 0.0, 0.0
        # atan(n / c) c / n = 1 + z / 3 + z^2 / 5 + ..., and its derivatives by s.
        for k in range(1, TERMS):
            g_s -= k * power / (2 * k + 1)
            if k < TERMS - 1:
                g_ss += (k + 1) * k * power / (2 * k + 3)
            power *= z
            g += power / (2 * k + 1)
        g, g_s, g_ss = 2.0 * g / c, 2.0 * g_s / (c * c * c), 2.0 * g_ss / (c * c * c * c * c)
    else:
        n = math.sqrt(s)
        g = 2.0 * math.atan2(n, c) / n
        g_s = (c / D - 0.5 * g) / s
        g_ss = -(c / (D * D) + 1.5 * g_s) / s
    return g, -2.0 / D, g_s, 4.0 * c / (D * D), 2.0 / (D * D), g_ss


@compiled
def rotation_vector(x):
    """phi [rad], 3-tuple."""
    g = _slopes(x)[0]
    return (g * x[1], g * x[2], g * x[3])


@compiled
def _slope_along(x, w):
    """d(w . phi)/dx, 4-tuple."""
    g, g_c, g_s, _, _, _ = _slopes(x)
    S = w[0] * x[1] + w[1] * x[2] + w[2] * x[3]
    t = 2.0 * g_s * S
    return (g_c * S, g * w[0] + t * x[1], g * w[1] + t * x[2], g * w[2] + t * x[3])


@compiled
def _curvature_along(x, w, d):
    """d2(w . phi)/dx2 d, 4-tuple."""
    _, g_c, g_s, g_cc, g_cs, g_ss = _slopes(x)
    e, f = (x[1], x[2], x[3]), (d[1], d[2], d[3])
    S, wf, ef = dot(w, e), dot(w, f), dot(e, f)
    along_w = g_c * d[0] + 2.0 * g_s * ef
    along_e = 2.0 * g_cs * S * d[0] + 2.0 * g_s * wf + 4.0 * g_ss * S * ef
    along_f = 2.0 * g_s * S
    return (
        g_cc * S * d[0] + g_c * wf + 2.0 * g_cs * S * ef,
        along_w * w[0] + along_e * e[0] + along_f * f[0],
        along_w * w[1] + along_e * e[1] + along_f * f[1],
        along_w * w[2] + along_e * e[2] + along_f * f[2],
    )


@compiled
def _column(q, oi, oj, ci, cj, n):
    """dx/dp_n, n = 0..3 of body i, 4..7 of body j, without the sign."""
    if n < 4:
        return relative_parameters(PARAMETERS[n], ci, euler_parameters(q, oj), cj)
    return relative_parameters(euler_parameters(q, oi), ci, PARAMETERS[n - 4], cj)


@compiled
def _place(oi, oj, n):
    """Local coordinate of Euler parameter n of both bodies."""
    return oi + 3 + n if n < 4 else oj + n - 1


@compiled
def add_vector_gradient(k, oi, oj, ci, cj, w, q, G):
    """G[k, :] += (w . phi)_q."""
    x, sign = short_way(q, oi, oj, ci, cj)
    slope = scaled4(sign, _slope_along(x, w))
    for n in range(8):
        G[k, _place(oi, oj, n)] += inner4(slope, _column(q, oi, oj, ci, cj, n))


@compiled
def add_vector_rate_gradient(k, oi, oj, ci, cj, w, q, v, W):
    """W[k, :] += ((w . phi)_q v)_q."""
    x, sign = short_way(q, oi, oj, ci, cj)
    slope, rate = scaled4(sign, _slope_along(x, w)), (0.0, 0.0, 0.0, 0.0)
    for n in range(8):
        d, change = _column(q, oi, oj, ci, cj, n), v[_place(oi, oj, n)]
        rate = sum4(rate, scaled4(change, d))
    bend = _curvature_along(x, w, rate)
    for n in range(8):
        at = _place(oi, oj, n)
        W[k, at] += inner4(bend, _column(q, oi, oj, ci, cj, n)) + inner4(slope, _column(v, oi, oj, ci, cj, n))


@compiled
def add_vector_hessian(oi, oj, ci, cj, w, q, H):
    """H += (w . phi)_qq."""
    x, sign = short_way(q, oi, oj, ci, cj)
    slope = scaled4(sign, _slope_along(x, w))
    for n in range(8):
        bend = _curvature_along(x, w, _column(q, oi, oj, ci, cj, n))
        for m in range(8):
            H[_place(oi, oj, n), _place(oi, oj, m)] += inner4(bend, _column(q, oi, oj, ci, cj, m))
    for n in range(4):
        for m in range(4):
            cross_term = inner4(slope, relative_parameters(PARAMETERS[n], ci, PARAMETERS[m], cj))
            H[oi + 3 + n, oj + 3 + m] += cross_term
            H[oj + 3 + m, oi + 3 + n] += cross_term

"""The length of a straight span whose vector is a sum of parts of bodies, with its derivatives.

    d = sum_k n_k (t_k r_k + A_k s_k),   l = |d|,   w = d / l
    l_q = sum_k n_k (t_k w, (A_k s_k)_p^T w),   l_qq = d_q^T (I - w w^T) / l d_q + (w . d)_qq at fixed w

n_k is 1 or -1; t_k is 1 where the part moves with the body's centre of mass, and 0 where it only turns with the body.
The rope that leaves a drum needs it: the point where it leaves moves with the drum's axis, and turns with what carries
the drum. Tables, from index i of `ip` and index j of `par`, for n parts:

    ip[i] = n,  then (offset of the body, t_k, n_k) for each
    par[j] = s_k for each, three numbers [m]
"""

import math

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import (
    across,
    add,
    add_hessian,
    columns,
    dot,
    euler_parameters,
    k_times,
    rotated,
    rotated_rate,
    scale,
    vec,
)

SHORTEST = 1e-12
"""Length [m] below which a span has no direction; keeps the kernels finite where both ends meet."""


@compiled
def _part(ip, i, par, j, k):
    """Offset of the body, t, n, s of part k."""
    return ip[i + 1 + 3 * k], 1.0 * ip[i + 2 + 3 * k], 1.0 * ip[i + 3 + 3 * k], vec(par, j + 3 * k)


@compiled
def _span(ip, i, par, j, q):
    """(w, l)."""
    d = (0.0, 0.0, 0.0)
    for k in range(ip[i]):
        o, t, n, s = _part(ip, i, par, j, k)
        d = add(d, scale(n, add(scale(t, vec(q, o)), rotated(q, o, s))))
    length = max(math.sqrt(dot(d, d)), SHORTEST)
    return scale(1.0 / length, d), length


@compiled
def _add_parts(ip, i, par, j, w, x, factor, translates, into):
    """into += factor (w . d)_q; x holds the Euler parameters (or their rates) by which K(w, s) is multiplied."""
    for k in range(ip[i]):
        o, t, n, s = _part(ip, i, par, j, k)
        g = k_times(w, s, euler_parameters(x, o))
        if translates:
            for m in range(3):
                into[o + m] += factor * n * t * w[m]
        for m in range(4):
            into[o + 3 + m] += 2.0 * factor * n * g[m]


@compiled
def add_span_gradient(ip, i, par, j, q, factor, into):
    """into += factor l_q; gives l [m]."""
    w, length = _span(ip, i, par, j, q)
    _add_parts(ip, i, par, j, w, q, factor, True, into)
    return length


@compiled
def add_span_rate_gradient(ip, i, par, j, q, v, factor, into):
    """into += factor (l_q v)_q."""
    w, length = _span(ip, i, par, j, q)
    d_t = (0.0, 0.0, 0.0)
    for k in range(ip[i]):
        o, t, n, s = _part(ip, i, par, j, k)
        d_t = add(d_t, scale(n, add(scale(t, vec(v, o)), rotated_rate(q, v, o, s))))
    w_t = scale(1.0 / length, across(d_t, w))
    _add_parts(ip, i, par, j, w_t, q, factor, True, into)
    _add_parts(ip, i, par, j, w, v, factor, False, into)


@compiled
def _column(q, o, t, n, s, m):
    """Derivative of n (t r + A s) by local coordinate m of its body."""
    if m < 3:
        return scale(n * t, (1.0 * (m == 0), 1.0 * (m == 1), 1.0 * (m == 2)))
    return scale(n, columns(q, o, s)[m - 3])


@compiled
def add_span_hessian(ip, i, par, j, q, factor, H):
    """H += factor l_qq."""
    w, length = _span(ip, i, par, j, q)
    for k in range(ip[i]):
        o, t, n, s = _part(ip, i, par, j, k)
        add_hessian(H, o, w, s, factor * n)
        for m in range(7):
            x = _column(q, o, t, n, s, m)
            x = scale(factor / length, across(x, w))
            for k2 in range(ip[i]):
                o2, t2, n2, s2 = _part(ip, i, par, j, k2)
                for m2 in range(7):
                    H[o + m, o2 + m2] += dot(x, _column(q, o2, t2, n2, s2, m2))

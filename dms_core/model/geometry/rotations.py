"""Vectors and Euler parameters as tuples: the algebra every kernel is written in.

With p = (p0, e), e a 3-vector, the rotation matrix is the homogeneous quadratic form

    A(p) s = (p0^2 - e.e) s + 2 (e.s) e + 2 p0 e x s                       (Haug 1989, 9.3)

so that for a fixed vector w

    w . A(p) s = p^T K(w, s) p,   K(w, s) = [[w.s, (s x w)^T], [s x w, w s^T + s w^T - (w.s) I]]

and every derivative of a joint equation is a product with K: gradient 2 K p, Hessian 2 K.
A body occupies seven local coordinates from offset o: position q[o:o+3], Euler parameters q[o+3:o+7].
Tuples live in registers: nothing here allocates.
"""

from dms_core.compiled.jit import compiled

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Unit vectors along x, y and z."""


@compiled
def vec(x, k):
    """Three entries of the array x from index k, as a tuple."""
    return (x[k], x[k + 1], x[k + 2])


@compiled
def add(a, b):
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@compiled
def sub(a, b):
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@compiled
def scale(c, a):
    """c a."""
    return (c * a[0], c * a[1], c * a[2])


@compiled
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a, b):
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@compiled
def across(x, n):
    """The part of x across a unit triple n: x - (n . x) n."""
    return sub(x, scale(dot(n, x), n))


@compiled
def across_change(x, n, dx, dn):
    """Its change for changes of x and n."""
    return sub(sub(dx, scale(dot(dn, x) + dot(n, dx), n)), scale(dot(n, x), dn))


@compiled
def combination(s, par, at, step, n, x, first):
    """s + sum_k x[first + k] P_k, k = 0..n - 1, for triples P_k that stand in par from at, `step` numbers apart."""
    for k in range(n):
        s = add(s, scale(x[first + k], vec(par, at + step * k)))
    return s


@compiled
def euler_parameters(x, o):
    """Entries 3..6 of a body's block at offset o (of q, v or vdot), as a 4-tuple."""
    return (x[o + 3], x[o + 4], x[o + 5], x[o + 6])


@compiled
def bilinear(p, x, s):
    """The symmetric bilinear form behind A: bilinear(p, p, s) = A(p) s, d(A s)[x] = 2 bilinear(p, x, s)."""
    e, f = (p[1], p[2], p[3]), (x[1], x[2], x[3])
    c = p[0] * x[0] - dot(e, f)
    es, fs = dot(e, s), dot(f, s)
    g = cross((p[0] * f[0] + x[0] * e[0], p[0] * f[1] + x[0] * e[1], p[0] * f[2] + x[0] * e[2]), s)
    return (
        c * s[0] + fs * e[0] + es * f[0] + g[0],
        c * s[1] + fs * e[1] + es * f[1] + g[1],
        c * s[2] + fs * e[2] + es * f[2] + g[2],
    )


@compiled
def rotated(q, o, s):
    """A(p) s for the body at offset o: a body-fixed vector in ground axes."""
    p = euler_parameters(q, o)
    return bilinear(p, p, s)


@compiled
def rotated_rate(q, v, o, s):
    """d(A s)/dt for the body at offset o."""
    return scale(2.0, bilinear(euler_parameters(q, o), euler_parameters(v, o), s))


@compiled
def point(q, o, s):
    """r + A s: a body-fixed point in ground axes [m]."""
    return add(vec(q, o), rotated(q, o, s))


@compiled
def point_rate(q, v, o, s):
    """Velocity of a body-fixed point in ground axes [m/s]."""
    return add(vec(v, o), rotated_rate(q, v, o, s))


@compiled
def k_times(w, s, x):
    """K(w, s) x for a 4-tuple x."""
    c, k, e = cross(s, w), dot(w, s), (x[1], x[2], x[3])
    se, we = dot(s, e), dot(w, e)
    return (
        k * x[0] + dot(c, e),
        c[0] * x[0] + w[0] * se + s[0] * we - k * e[0],
        c[1] * x[0] + w[1] * se + s[1] * we - k * e[1],
        c[2] * x[0] + w[2] * se + s[2] * we - k * e[2],
    )


@compiled
def add_gradient(G, i, o, q, w, s, factor):
    """G[i, p] += factor d(w . A s)/dp for the body at offset o, w held fixed."""
    g = k_times(w, s, euler_parameters(q, o))
    for k in range(4):
        G[i, o + 3 + k] += 2.0 * factor * g[k]


@compiled
def add_row_hessian(W, i, o, x, w, s, factor):
    """W[i, p] += factor x^T d2(w . A s)/dp2 for the body at offset o; x is a block of seven (velocities)."""
    g = k_times(w, s, euler_parameters(x, o))
    for k in range(4):
        W[i, o + 3 + k] += 2.0 * factor * g[k]


@compiled
def add_hessian(H, o, w, s, factor):
    """H[p, p] += factor d2(w . A s)/dp2 = 2 factor K(w, s) for the body at offset o."""
    c, k = cross(s, w), dot(w, s)
    H[o + 3, o + 3] += 2.0 * factor * k
    for i in range(3):
        H[o + 3, o + 4 + i] += 2.0 * factor * c[i]
        H[o + 4 + i, o + 3] += 2.0 * factor * c[i]
        for j in range(3):
            H[o + 4 + i, o + 4 + j] += 2.0 * factor * (w[i] * s[j] + s[i] * w[j])
        H[o + 4 + i, o + 4 + i] -= 2.0 * factor * k


@compiled
def columns(q, o, s):
    """The four columns of d(A s)/dp (3 x 4) for the body at offset o: 2 [d, (e.s) I + [d]x] with d = p0 s + e x s."""
    p = euler_parameters(q, o)
    e = (p[1], p[2], p[3])
    d, c = scale(2.0, add(scale(p[0], s), cross(e, s))), 2.0 * dot(e, s)
    return d, (c, -d[2], d[1]), (d[2], c, -d[0]), (-d[1], d[0], c)


@compiled
def add_cross_hessian(H, q, oi, si, oj, sj, factor):
    """H[p_i, p_j] += factor (d(A_i s_i)/dp_i)^T d(A_j s_j)/dp_j, and its transpose into H[p_j, p_i]."""
    ci, cj = columns(q, oi, si), columns(q, oj, sj)
    for k in range(4):
        for m in range(4):
            h = factor * dot(ci[k], cj[m])
            H[oi + 3 + k, oj + 3 + m] += h
            H[oj + 3 + m, oi + 3 + k] += h


@compiled
def turned(n, c, s, x):
    """A triple x turned about the unit triple n by an angle with cosine c and sine s (Rodrigues' formula)."""
    w, along = cross(n, x), (1.0 - c) * dot(n, x)
    return c * x[0] + s * w[0] + along * n[0], c * x[1] + s * w[1] + along * n[1], c * x[2] + s * w[2] + along * n[2]

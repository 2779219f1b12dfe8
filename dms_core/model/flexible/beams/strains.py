"""Strain measures of a beam between two sections, with first and second derivatives along any direction.

Two sections have positions r_i, r_j and Euler parameters p, s (s turned in sign so that p.s >= 0). Two three-vectors
tell how they lie to each other, and neither changes when both move as one rigid body:

    stretch   g = A(m)^T (r_j - r_i),  m = p + s       the vector between them, seen from the frame half-way
    turn      theta = 2 atan2(|e|, c) e / |e|          the rotation vector from one to the other, (c, e) = conj(p) s

A(m) for m of any length stands for the rotation, A(m) / m.m. Divided by the length, stretch less e_1 is the axial and
the two shear strains of Reissner and Simo, turn the twist and the two curvatures (J. C. Simo (1985), Comput. Methods
Appl. Mech. Eng. 49:55-70), both constant between the sections.

For each measure there are four functions: the value; `_rate`, its derivative along (x, y); `_pull`, the transposed
derivative applied to a force f; `_pull_rate`, the derivative of that along (x, y) at fixed f.
"""

import math

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.quaternions import conjugate, inner4
from dms_core.model.geometry.rotations import bilinear, dot, k_times

NEAR = 0.01
"""Square of the tangent of half the turn below which series replace quotients of small numbers: seven terms are then
exact to 1e-14, and the quotients above lose four digits of the last derivative at most."""


@compiled
def stretch(m, d):
    """g = A(m)^T d / m.m."""
    c = conjugate(m)
    g, n = bilinear(c, c, d), 1.0 / inner4(m, m)
    return (n * g[0], n * g[1], n * g[2])


@compiled
def stretch_rate(m, d, g, x, y):
    """Derivative of the stretch g along x of m and y of d."""
    c = conjugate(m)
    a, b, n, f = bilinear(c, conjugate(x), d), bilinear(c, c, y), 1.0 / inner4(m, m), 2.0 * inner4(m, x)
    return (
        n * (2.0 * a[0] + b[0] - f * g[0]),
        n * (2.0 * a[1] + b[1] - f * g[1]),
        n * (2.0 * a[2] + b[2] - f * g[2]),
    )


@compiled
def stretch_pull(m, d, g, f):
    """(by d, by m) of f . g."""
    n, k, e = 1.0 / inner4(m, m), k_times(d, f, m), dot(f, g)
    a = bilinear(m, m, f)
    h = 2.0 * n
    return (
        (n * a[0], n * a[1], n * a[2]),
        (h * (k[0] - e * m[0]), h * (k[1] - e * m[1]), h * (k[2] - e * m[2]), h * (k[3] - e * m[3])),
    )


@compiled
def stretch_pull_rate(m, d, g, x, y, f):
    """Derivative of `stretch_pull` along x of m and y of d at fixed f."""
    n, mx = 1.0 / inner4(m, m), 2.0 * inner4(m, x)
    a, b = bilinear(m, x, f), bilinear(m, m, f)
    k, kx, ky = k_times(d, f, m), k_times(d, f, x), k_times(y, f, m)
    e, e_rate, h, w = dot(f, g), dot(f, stretch_rate(m, d, g, x, y)), 2.0 * n, mx * n
    return (
        (n * (2.0 * a[0] - w * b[0]), n * (2.0 * a[1] - w * b[1]), n * (2.0 * a[2] - w * b[2])),
        (
            h * (kx[0] + ky[0] - e * x[0] - e_rate * m[0] - w * (k[0] - e * m[0])),
            h * (kx[1] + ky[1] - e * x[1] - e_rate * m[1] - w * (k[1] - e * m[1])),
            h * (kx[2] + ky[2] - e * x[2] - e_rate * m[2] - w * (k[2] - e * m[2])),
            h * (kx[3] + ky[3] - e * x[3] - e_rate * m[3] - w * (k[3] - e * m[3])),
        ),
    )


@compiled
def turn_factors(c):
    """(f, h, k): f = atan2(|e|, c0) / |e| for c = (c0, e), then h = f' / |e| and k = h' / |e|, primes by |e|."""
    square, c0 = c[1] * c[1] + c[2] * c[2] + c[3] * c[3], c[0]
    if square < NEAR * c0 * c0:
        x, q = square / (c0 * c0), 1.0 / (c0 * c0)
        # f = sum (-x)^n / (2 n + 1) over c0; h and k are twice its derivative by x, once and again.
        f, h, k, lower, power, sign = 1.0 - x / 3.0, -2.0 / 3.0, 0.0, 1.0, x, 1.0
        for n in range(2, 10):
            share = sign / (2.0 * n + 1.0)
            k += 4.0 * n * (n - 1.0) * share * lower
            h += 2.0 * n * share * power
            f += share * power * x
            lower, power, sign = power, power * x, -sign
        return f / c0, h * q / c0, k * q * q / c0
    size, total = math.sqrt(square), square + c0 * c0
    f = math.atan2(size, c0) / size
    h = (c0 / total - f) / square
    return f, h, -(2.0 * c0 / (total * total) + 3.0 * h) / square


@compiled
def turn(c, factors):
    """theta of the relative Euler parameters c of any length, c0 >= 0."""
    f = 2.0 * factors[0]
    return (f * c[1], f * c[2], f * c[3])


@compiled
def turn_rate(c, factors, x):
    """Derivative of theta along x of c."""
    e, y, n = (c[1], c[2], c[3]), (x[1], x[2], x[3]), 1.0 / inner4(c, c)
    f, rate = 2.0 * factors[0], 2.0 * (factors[1] * dot(e, y) - n * x[0])
    return (rate * e[0] + f * y[0], rate * e[1] + f * y[1], rate * e[2] + f * y[2])


@compiled
def turn_pull(c, factors, m):
    """Gradient by c of m . theta."""
    e, f = (c[1], c[2], c[3]), 2.0 * factors[0]
    b = 2.0 * dot(m, e)
    h = b * factors[1]
    return (-b / inner4(c, c), f * m[0] + h * e[0], f * m[1] + h * e[1], f * m[2] + h * e[2])


@compiled
def turn_pull_rate(c, factors, x, m):
    """Derivative of `turn_pull` along x of c at fixed m."""
    e, y, n = (c[1], c[2], c[3]), (x[1], x[2], x[3]), 1.0 / inner4(c, c)
    ey, b, b_rate, n_rate = dot(e, y), 2.0 * dot(m, e), 2.0 * dot(m, y), 2.0 * inner4(c, x)
    f_rate, h_rate = factors[1] * ey - n * x[0], factors[2] * ey + 2.0 * n * n * x[0]
    f, h, g = 2.0 * f_rate, b_rate * factors[1] + b * h_rate, b * factors[1]
    return (
        n * (n * b * n_rate - b_rate),
        f * m[0] + h * e[0] + g * y[0],
        f * m[1] + h * e[1] + g * y[1],
        f * m[2] + h * e[2] + g * y[2],
    )

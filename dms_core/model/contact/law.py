"""The force of a contact: Hunt and Crossley's law along the normal, regularised Coulomb friction across it.

With the depth x > 0, its rate, and the slip velocity w of body j against body i in the plane of contact:

    N = k x^(3/2) (1 + D xdot), at least 0              F = N (n - mu w / sqrt(|w|^2 + s^2))

The law along the normal is that of K. H. Hunt and F. R. E. Crossley (1975), J. Appl. Mech. 42:440-445. In an impact in
which nothing else acts, m xddot = -N has a first integral, from which the speeds v before and e v after it follow:

    d (1 + e) = ln((1 + d) / (1 - e d)),   d = D v

so that D = d / v gives the restitution e exactly for an impact at the speed v; a slower one gives back more of its
speed, a faster one less. As e goes to 0, d goes to 1 / e: a restitution of 0 itself is not within this law.

Friction is that of Coulomb but for the speed s: a contact that would stick creeps. A body on a slope of angle a, with
tan a < mu, creeps down it at s tan a / sqrt(mu^2 - tan^2 a).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import across, across_change, add, dot, scale, sub

TERMS = 40
"""Terms of the series of both logarithms where d is below 0.3: what is left out is below 1e-20."""


def damping_number(restitution: float) -> float:
    """The d > 0 of d (1 + e) = ln((1 + d) / (1 - e d)) for 0 < e < 1; 0 for e = 1."""
    e = restitution
    if e >= 1.0:
        return 0.0
    k = np.arange(2, TERMS)
    series = (e**k - (-1.0) ** k) / k

    def open_by(z: float) -> float:
        """(ln((1 + d) / (1 - e d)) - d (1 + e)) / d, with e d = 1 - exp(-z), so that d stays below 1 / e."""
        d = -math.expm1(-z) / e
        # Where both logarithms are nearly linear, what is left of them is their series: sum_k (e^k - (-1)^k) d^(k-1)/k.
        if d < 0.3:
            return float(series @ d ** (k - 1.0))
        return (math.log1p(d) + z) / d - (1.0 + e)

    # Below the root it is negative, and far above, where d is 1 / e, it grows with z.
    z = float(brentq(open_by, 1e-3 * e * (1.0 - e), 3.0 + 3.0 / e, xtol=1e-300, rtol=1e-15, maxiter=500))
    return -math.expm1(-z) / e


@compiled
def normal_force(stiffness, damping, depth, rate):
    """(N, derivative by depth, derivative by rate); N = 0 without depth, and where the law would pull."""
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    grip = 1.0 + damping * rate
    if grip <= 0.0:
        return 0.0, 0.0, 0.0
    root = stiffness * math.sqrt(depth)
    return root * depth * grip, 1.5 * root * grip, root * depth * damping


@compiled
def slip_of(slip_speed, n, w):
    """The part of w across n [m/s], and its regularised size."""
    slip = across(w, n)
    return slip, math.sqrt(dot(slip, slip) + slip_speed * slip_speed)


@compiled
def contact_force(friction, slip_speed, N, n, w):
    """F on body j [N]; w is the velocity of body j against body i at the contact."""
    slip, size = slip_of(slip_speed, n, w)
    return scale(N, sub(n, scale(friction / size, slip)))


@compiled
def contact_force_change(friction, slip_speed, N, n, w, dN, dn, dw):
    """The change of F for changes of N, n and w."""
    slip, size = slip_of(slip_speed, n, w)
    d_slip = across_change(w, n, dw, dn)
    d_size = dot(slip, d_slip) / size
    direction = sub(n, scale(friction / size, slip))
    d_direction = add(sub(dn, scale(friction / size, d_slip)), scale(friction * d_size / (size * size), slip))
    return add(scale(dN, direction), scale(N, d_direction))

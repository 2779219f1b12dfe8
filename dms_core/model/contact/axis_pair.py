"""Nearest points of the axes of two cylinders, of finite lengths.

With d = c_j - c_i between the middles, axes f_i, f_j and halves of the lengths h_i, h_j, the points c_i + s f_i and
c_j + t f_j, |s| <= h_i and |t| <= h_j, have the least

    |d + t f_j - s f_i|^2 + e_i s^2 + e_j t^2,   e_i = PARALLEL^2 h_j^2 / (h_i^2 + h_j^2), likewise e_j with h_i^2

that is (1 + e_i) s - c t = f_i . d and (1 + e_j) t - c s = -f_j . d with c = f_i . f_j, a coordinate at its bound held
there. Without e axes that are parallel would have no nearest points; with it these pass to the middle of what both
share, as the axes come as near to parallel as PARALLEL. Elsewhere the distance errs by e s^2 / 2 |d|: at most 1e-5 of a
length whose axes cross at the end, a length apart. A tilt theta in the plane of d moves the points by |d| theta / 2 e.
"""

from __future__ import annotations

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import dot

PARALLEL = 1e-2
"""Sine of the angle between the axes from which on their nearest points pass to the middles. At a tenth of it a roller
tilted by 1e-5 rocks between its ends in 8,000 steps where it now takes 3,000, or 500 on two contacts."""


@compiled
def _bound(x, h):
    """x within -h and h."""
    return min(max(x, -h), h)


@compiled
def loosened(h_i, h_j):
    """(1 + e_i, 1 + e_j)."""
    share = PARALLEL * PARALLEL / (h_i * h_i + h_j * h_j)
    return 1.0 + share * h_j * h_j, 1.0 + share * h_i * h_i


@compiled
def nearest(d, f_i, f_j, h_i, h_j):
    """(s, t, whether s is free, whether t is free); neither, one or both may be at a bound."""
    k_i, k_j = loosened(h_i, h_j)
    a, b, c = dot(f_i, d), dot(f_j, d), dot(f_i, f_j)
    free = (k_j * a - c * b) / (k_i * k_j - c * c)
    s = _bound(free, h_i)
    t_free = (c * s - b) / k_j
    t = _bound(t_free, h_j)
    if t == t_free:
        return s, t, s == free, True
    # With t at its bound the best s is another one.
    free = (a + c * t) / k_i
    s = _bound(free, h_i)
    return s, t, s == free, False


@compiled
def nearest_change(s, t, s_is_free, t_is_free, h_i, h_j, c, da, db, dc):
    """(ds, dt) for changes of f_i . d, f_j . d and c = f_i . f_j."""
    k_i, k_j = loosened(h_i, h_j)
    x, y = da + dc * t, dc * s - db
    if s_is_free and t_is_free:
        det = k_i * k_j - c * c
        return (k_j * x + c * y) / det, (c * x + k_i * y) / det
    return (x / k_i if s_is_free else 0.0), (y / k_j if t_is_free else 0.0)

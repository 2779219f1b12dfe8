"""Path of a rope or muscle: straight segments through points of bodies (paper sect. 3.3, 3.4). Geometry, no force.

A segment from x_a = r_a + A_a s_a to x_b = r_b + A_b s_b, with d = x_b - x_a, w = d/|d| and P = (I - w w^T)/|d|:

    l = sum |d|,   l_q = sum w^T d_q,   l_qq = sum d_q^T P d_q + (w^T d_q)_q at fixed w,   ldot = sum w . ddot

Segments between two points of one body keep their length: they are summed once into a constant. Only segments that
cross from body to body remain, and points of the ground are constants without coordinates.

Tables of a path, from index i of `ip` and index j of `par`, for n crossing segments:

    ip[i] = n,  then (o_a, o_b) for each: where the body's seven coordinates begin, -1 for the ground
    par[j] = constant length [m],  then (s_a, s_b) for each [m]
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import DmsError, ModelError
from dms_core.model.element import GROUND, Vector
from dms_core.model.geometry.rotations import (
    across,
    add_hessian,
    columns,
    dot,
    euler_parameters,
    k_times,
    point,
    point_rate,
    scale,
    sub,
    vec,
)
from dms_core.validation import Checked

SHORTEST = 1e-12
"""Length [m] below which a segment has no direction; keeps the kernels finite where two points meet."""


@compiled
def behind_path(ip, i, j):
    """Indices in `ip` and `par` behind the path that begins at i and j."""
    return i + 1 + 2 * ip[i], j + 1 + 6 * ip[i]


@compiled
def _end(q, o, s):
    """A path point in ground axes [m]."""
    if o < 0:
        return s
    return point(q, o, s)


@compiled
def _end_rate(q, v, o, s):
    """Velocity of a path point [m/s]."""
    if o < 0:
        return (0.0, 0.0, 0.0)
    return point_rate(q, v, o, s)


@compiled
def _segment(ip, i, par, j, k, q):
    """Crossing segment k: offsets and arms of its two points, unit vector from the first to the second, length."""
    oa, ob = ip[i + 1 + 2 * k], ip[i + 2 + 2 * k]
    sa, sb = vec(par, j + 1 + 6 * k), vec(par, j + 4 + 6 * k)
    d = sub(_end(q, ob, sb), _end(q, oa, sa))
    length = max(math.sqrt(dot(d, d)), SHORTEST)
    return oa, ob, sa, sb, scale(1.0 / length, d), length


@compiled
def _add_point_gradient(q, o, w, s, factor, x):
    """x += factor d(w . x_point)/dq at fixed w."""
    if o < 0:
        return
    g = k_times(w, s, euler_parameters(q, o))
    for m in range(3):
        x[o + m] += factor * w[m]
    for m in range(4):
        x[o + 3 + m] += 2.0 * factor * g[m]


@compiled
def path_length(ip, i, par, j, q):
    """l(q) [m]."""
    total = par[j]
    for k in range(ip[i]):
        total += _segment(ip, i, par, j, k, q)[5]
    return total


@compiled
def path_rate(ip, i, par, j, q, v):
    """l_q v [m/s]."""
    rate = 0.0
    for k in range(ip[i]):
        oa, ob, sa, sb, w, _ = _segment(ip, i, par, j, k, q)
        rate += dot(w, sub(_end_rate(q, v, ob, sb), _end_rate(q, v, oa, sa)))
    return rate


@compiled
def add_path_gradient(ip, i, par, j, q, factor, x):
    """x += factor l_q, shape (n,); gives l [m]."""
    total = par[j]
    for k in range(ip[i]):
        oa, ob, sa, sb, w, length = _segment(ip, i, par, j, k, q)
        total += length
        _add_point_gradient(q, ob, w, sb, factor, x)
        _add_point_gradient(q, oa, w, sa, -factor, x)
    return total


@compiled
def add_path_rate_gradient(ip, i, par, j, q, v, factor, x):
    """x += factor (l_q v)_q = factor l_qq v, shape (n,)."""
    for k in range(ip[i]):
        oa, ob, sa, sb, w, length = _segment(ip, i, par, j, k, q)
        d_t = sub(_end_rate(q, v, ob, sb), _end_rate(q, v, oa, sa))
        w_t = scale(1.0 / length, across(d_t, w))
        _add_point_gradient(q, ob, w_t, sb, factor, x)
        _add_point_gradient(q, oa, w_t, sa, -factor, x)
        _add_turning(v, ob, w, sb, factor, x)
        _add_turning(v, oa, w, sa, -factor, x)


@compiled
def _add_turning(v, o, w, s, factor, x):
    """x += factor d2(w . A s)/dp2 pdot."""
    if o < 0:
        return
    g = k_times(w, s, euler_parameters(v, o))
    for m in range(4):
        x[o + 3 + m] += 2.0 * factor * g[m]


@compiled
def add_path_hessian(ip, i, par, j, q, factor, H):
    """H += factor l_qq, shape (n, n)."""
    for k in range(ip[i]):
        oa, ob, sa, sb, w, length = _segment(ip, i, par, j, k, q)
        c = factor / length
        if ob >= 0:
            add_hessian(H, ob, w, sb, factor)
            _add_block(H, q, ob, sb, ob, sb, w, c)
        if oa >= 0:
            add_hessian(H, oa, w, sa, -factor)
            _add_block(H, q, oa, sa, oa, sa, w, c)
        if oa >= 0 and ob >= 0:
            _add_block(H, q, oa, sa, ob, sb, w, -c)
            _add_block(H, q, ob, sb, oa, sa, w, -c)


@compiled
def _add_block(H, q, oi, si, oj, sj, w, c):
    """H[i, j] += c [I, C_i]^T (I - w w^T) [I, C_j] with C = d(A s)/dp, for the bodies at oi and oj."""
    ci, cj = columns(q, oi, si), columns(q, oj, sj)
    for n in range(3):
        for m in range(3):
            H[oi + m, oj + n] -= c * w[m] * w[n]
        H[oi + n, oj + n] += c
    for n in range(4):
        y, x = cj[n], ci[n]
        y, x = scale(c, across(y, w)), scale(c, across(x, w))
        for m in range(3):
            H[oi + m, oj + 3 + n] += y[m]
            H[oi + 3 + n, oj + m] += x[m]
        for m in range(4):
            H[oi + 3 + m, oj + 3 + n] += dot(ci[m], y)


class PathPoint(Checked):
    """One point of a path."""

    wrong: ClassVar[type[DmsError]] = ModelError
    body: str = Field(default=GROUND, description="body that carries the point, or 'ground'")
    point: Vector = Field(description="in the reference frame of the body [m]")


class PathTable(NamedTuple):
    """A path laid out for the kernels."""

    bodies: tuple[str, ...]
    """Bodies whose coordinates move the length, in the order of their blocks; never the ground."""
    integers: tuple[int, ...]
    numbers: tuple[float, ...]

    @property
    def size(self) -> int:
        """Number of body coordinates."""
        return 7 * len(self.bodies)

    def offsets(self) -> np.ndarray:
        """Offsets (o_a, o_b) of each crossing segment, shape (segments, 2)."""
        return np.array(self.integers[1:], int).reshape(-1, 2)


def path_table(system, points: tuple[PathPoint, ...]) -> PathTable:
    """Crossing segments and constant length of a path through the given points, in their order."""
    crossing = [(a, b) for a, b in pairwise(points) if a.body != b.body]
    for p in points:
        system.body(p.body)
    bodies = tuple(dict.fromkeys(p.body for pair in crossing for p in pair if p.body != GROUND))
    offset = {body: 7 * k for k, body in enumerate(bodies)} | {GROUND: -1}
    constant = sum(math.dist(a.point, b.point) for a, b in pairwise(points) if a.body == b.body)
    integers = [len(crossing)] + [offset[p.body] for pair in crossing for p in pair]
    numbers = [constant] + [float(x) for pair in crossing for p in pair for x in system.arm(p.body, p.point)]
    return PathTable(bodies, tuple(integers), tuple(numbers))


def moving_path(system, who: str, points: tuple[PathPoint, ...]) -> PathTable:
    """As path_table; a path whose length cannot change is an error."""
    table = path_table(system, points)
    if not table.bodies:
        raise ModelError(
            f"{who}: all points of the path are on '{points[0].body}', so its length never changes; "
            "let it run over two bodies at least."
        )
    return table


def start_length(system, points: tuple[PathPoint, ...]) -> float:
    """Length with every body at its declared start pose [m]."""
    return sum(math.dist(*(system.start_point(p.body, p.point, GROUND) for p in pair)) for pair in pairwise(points))


def path_pattern(table: PathTable, size: int) -> np.ndarray:
    """Where l_qq can be non-zero: the two bodies of each crossing segment; shape (size, size), boolean."""
    pattern = np.zeros((size, size), bool)
    for pair in table.offsets():
        block = np.concatenate([np.arange(o, o + 7) for o in pair if o >= 0])
        pattern[np.ix_(block, block)] = True
    return pattern

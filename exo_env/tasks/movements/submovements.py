"""Movements as a sum of submovements, each of minimum jerk, which may overlap (Flash and Henis 1991).

    psi(t) = psi_0 + sum_i a_i s((t - t_i) / T_i),   s(x) = x^3 (10 - 15 x + 6 x^2) from 0 to 1, constant outside

When the target of a reach jumps, people add a second submovement to the first one, which goes on (Flash and Henis 1991,
J. Cogn. Neurosci. 3:220-230; Henis and Flash 1995, Biol. Cybern. 72:407-419). psi is a polynomial of degree 5 between
the times at which one begins or ends.
"""

from __future__ import annotations

import math

import numpy as np

from dms_core.compiled.jit import compiled
from exo_env.places import places

UNIT = places(("onset", "duration", "amplitude_deg"))
"""Columns of a table of submovements: begin [s], duration [s], amplitude [deg]; one without amplitude does nothing."""


@compiled
def put_sum(start_deg, units, t, c):
    """Fill pieces of psi.

    Args:
        start_deg: psi_0 [deg].
        units: submovements, at the places of UNIT, shape (n, 3).
        t: starts of the pieces [s], shape (k,), k from 2 n + 1; pieces that are too many repeat the last one.
        c: their coefficients, shape (k, 6).
    """
    n, used = units.shape[0], 1
    times = np.empty(2 * n)
    for i in range(n):
        times[2 * i] = units[i, UNIT.onset]
        times[2 * i + 1] = units[i, UNIT.onset] + units[i, UNIT.duration]
    times.sort()
    t[0] = min(times[0], 0.0) - 1.0
    for i in range(2 * n):
        if times[i] > t[used - 1]:
            t[used] = times[i]
            used += 1
    c[:] = 0.0
    for k in range(used):
        c[k, 0] = math.radians(start_deg)
        for i in range(n):
            add_unit(units[i], t[k], c[k])
    for k in range(used, t.shape[0]):
        t[k], c[k] = t[used - 1], c[used - 1]


@compiled
def add_unit(unit, start, c):
    """Add one submovement to the coefficients of a piece that begins at `start` [s] and lies in or outside of it."""
    a, duration = math.radians(unit[UNIT.amplitude_deg]), unit[UNIT.duration]
    # The place in the submovement; a piece begins at its begin or end, but for rounding.
    x = (start - unit[UNIT.onset]) / duration
    if x < -1e-9 or a == 0.0:
        return
    if x > 1.0 - 1e-9:
        c[0] += a
        return
    # Taylor's expansion of s about x.
    u = 1.0 - x
    c[0] += a * x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    c[1] += a * 30.0 * x * x * u * u / duration
    c[2] += a * 30.0 * x * u * (1.0 - 2.0 * x) / duration**2
    c[3] += a * (10.0 - 60.0 * x + 60.0 * x * x) / duration**3
    c[4] += a * (30.0 * x - 15.0) / duration**4
    c[5] += a * 6.0 / duration**5

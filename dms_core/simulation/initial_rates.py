"""Accelerations, multipliers and first-order rates that belong to given q and v: the right-hand limit at a start.

    r2(q, v, vdot, lam) = 0,    phi_q vdot + (phi_q v)_q v + phi_tt = 0

solved for vdot of second-order coordinates, v of first-order ones, and lam. Rigid bodies enter linearly; the fibres'
force-velocity curve makes it a Newton iteration, shortened where it turns back. Two cheaper ways serve SDIRK2:
`stage_rates` behind a step, whose first-order rates are right already, and `jump_rates` behind a jump of the inputs,
which changes first-order rates and accelerations linearly and leaves the matrix of the step before valid. All three are
called with a c0, which only `stage_rates` uses.
"""

import math

from dms_core.assembly.tables import MODEL, WORK
from dms_core.compiled.arena import flags, floats, inner, ints, naturals, number
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.parts import PARTS, run_part, run_rates
from dms_core.simulation.state import CLOCK, COUNTS, STATE, begin_matrix

MAX_ITERATIONS = 60
SMALL_CHANGE = 0.02
"""Correction of a first-order rate, over its nominal size, up to which its equation counts as linear."""
TOLERANCE = 1e-11
"""Relative size of the last correction: the problem is solved to rounding, since all that follows builds on it."""
MOST_AGAIN = 3
SOLVED = 1e-9
"""Correction of a first-order rate, over its nominal size, that says that the matrix belongs to it to rounding."""
ROUNDING = 1e-3
"""Correction of an acceleration, over 1 + its size, below which one that no longer shrinks is rounding.

Accelerations and multipliers enter linearly, so that corrections shrink until r2 is what rounding leaves of its terms,
M vdot and phi_q^T lam: 1e-16 of a moment of 1000 N m, on an inertia of 1e-6 kg m^2, is an acceleration of 1e-7."""


@compiled
def _change(m, s):
    """Add the correction to the unknowns; gives the largest relative one."""
    w, second = inner(s, STATE.w), flags(m, MODEL.second)
    free, active = naturals(m, MODEL.free), naturals(m, MODEL.active)
    scale, x = floats(m, MODEL.scale_v), floats(s, STATE.rate_x)
    v, a, lam = floats(w, WORK.v), floats(w, WORK.a), floats(w, WORK.lam)
    n, largest = free.shape[0], 0.0
    for k in range(n):
        i, change = free[k], x[k]
        if second[i]:
            a[i] += change
            size = abs(change) / (1.0 + abs(a[i]))
        else:
            v[i] += change
            size = abs(change) / (scale[i] + abs(v[i]))
        if not size < math.inf:
            return math.inf
        largest = max(largest, size)
    for k in range(active.shape[0]):
        lam[active[k]] += x[n + k]
    return largest


@compiled
def _correct(m, s, part):
    """Newton correction at the present unknowns from the matrix that `part` makes; False if that is singular."""
    w, b = inner(s, STATE.w), floats(s, STATE.rate_b)
    free, active = naturals(m, MODEL.free), naturals(m, MODEL.active)
    run_part(m, s, part)
    r2, phi_a = floats(w, WORK.r2), floats(w, WORK.phi_a)
    n = free.shape[0]
    for i in range(n):
        b[i] = -r2[free[i]]
    for k in range(active.shape[0]):
        b[n + k] = -phi_a[active[k]]
    ints(s, STATE.counts)[COUNTS.factorisations] += 1
    if not floats(s, STATE.clock)[CLOCK.pivot] > 0.0:
        return False
    run_part(m, s, PARTS.rate_solution)
    return True


@compiled
def _first_order_change(m, s):
    """Largest correction of a first-order rate, over its nominal size: only these enter nonlinearly."""
    second, scale, x = flags(m, MODEL.second), floats(m, MODEL.scale_v), floats(s, STATE.rate_x)
    free, largest = naturals(m, MODEL.free), 0.0
    for k in range(free.shape[0]):
        if not second[free[k]]:
            largest = max(largest, abs(x[k]) / scale[free[k]])
    return largest


@compiled
def _shorten(m, s):
    """Limit a first-order correction that turns back to half of the one before.

    Newton's method alone may step to and fro over the kink of a force-velocity curve; with this it closes in on it.
    """
    second, free = flags(m, MODEL.second), naturals(m, MODEL.free)
    x, before = floats(s, STATE.rate_x), floats(s, STATE.x_before)
    for k in range(free.shape[0]):
        if not second[free[k]]:
            if x[k] * before[k] < 0.0 and abs(x[k]) > 0.5 * abs(before[k]):
                x[k] = math.copysign(0.5 * before[k], x[k])
            before[k] = x[k]


@compiled
def _iterate(m, s):
    """Newton's method for the rates, from the present guess; False if it does not converge."""
    floats(s, STATE.x_before)[:] = 0.0
    least = math.inf
    for _ in range(MAX_ITERATIONS):
        if not _correct(m, s, PARTS.rate_matrix):
            return False
        _shorten(m, s)
        change = _change(m, s)
        if not change < math.inf:
            return False
        if change < TOLERANCE:
            return True
        if 0.5 * least < change < ROUNDING and _first_order_change(m, s) < TOLERANCE:
            return True
        least = min(least, change)
    return False


@compiled
def _put_state(m, s):
    """q, v, vdot, lam of the state into the iterate."""
    w, second = inner(s, STATE.w), flags(m, MODEL.second)
    q, v, vd, lam = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.vd), floats(s, STATE.lam)
    q_w, v_w, a_w, lam_w, mu_w = (
        floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.a), floats(w, WORK.lam), floats(w, WORK.mu),
    )  # fmt: skip
    for i in range(q.shape[0]):
        q_w[i], v_w[i] = q[i], v[i]
        a_w[i] = vd[i] if second[i] else 0.0
    for k in range(lam.shape[0]):
        lam_w[k], mu_w[k] = lam[k], 0.0


@compiled
def _take_rates(m, s):
    """Rates and multipliers of the iterate into the state; the matrix belongs to its q and v."""
    w, second = inner(s, STATE.w), flags(m, MODEL.second)
    v, qd, vd = floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    v_w, a_w, lam_w = floats(w, WORK.v), floats(w, WORK.a), floats(w, WORK.lam)
    lam, lam_before, mu = floats(s, STATE.lam), floats(s, STATE.lam_before), floats(s, STATE.mu)
    for i in range(v.shape[0]):
        v[i] = qd[i] = v_w[i]
        vd[i] = a_w[i] if second[i] else 0.0
    for k in range(lam.shape[0]):
        lam[k] = lam_before[k] = lam_w[k]
        mu[k] = 0.0
    ints(s, STATE.counts)[COUNTS.rates_factored] = 1


@compiled
def consistent_rates(m, s, _c0):
    """Fill v (first-order), qd, vd, lam of the state at its q, v and the inputs in w.u; False on failure."""
    _put_state(m, s)
    if not _iterate(m, s):
        return False
    _take_rates(m, s)
    ints(s, STATE.counts)[COUNTS.stale] = 1
    return True


@compiled
def rates_again(m, s):
    """As consistent_rates, where first-order rates nearly solve their equations already, as at a recorded state.

    Accelerations and multipliers enter linearly, so that one correction does where first-order rates stay, and two
    where they are those of a stage. The matrix belongs to the state in either case.
    """
    _put_state(m, s)
    for _ in range(MOST_AGAIN):
        if not _correct(m, s, PARTS.rate_matrix) or not _change(m, s) < math.inf:
            break
        if _first_order_change(m, s) < SOLVED:
            _take_rates(m, s)
            return True
    return run_rates(m, s, PARTS.consistent_rates, 0.0)


@compiled
def stage_rates(m, s, c0):
    """As consistent_rates behind a step, whose first-order rates nearly solve their equations: one correction will do.

    False where it is not, as where a fibre's kink lies between: the rates of a step are as good as its tolerance only.
    With c0 > 0 the derivatives serve the Newton matrix of the next step as well.
    """
    part = PARTS.rate_matrix
    if c0 > 0.0:
        part = PARTS.both_matrices
        begin_matrix(s, c0)
    _put_state(m, s)
    if not _correct(m, s, part) or not _first_order_change(m, s) < SMALL_CHANGE:
        return False
    if not _change(m, s) < math.inf:
        return False
    _take_rates(m, s)
    return True


@compiled
def jump_rates(m, s, _c0):
    """As consistent_rates behind a jump of the inputs, with the factors at hand; False without them or with a driver.

    q and v are those of the factors, and only rows of equations that read an input are open. Where one reads it not
    linearly, what is left over concerns the guess and the error estimate of the step alone.
    """
    if ints(s, STATE.counts)[COUNTS.rates_factored] != 1 or number(m, MODEL.driven) > 0:
        return False
    _put_state(m, s)
    run_part(m, s, PARTS.residual)
    b, r2 = floats(s, STATE.rate_b), floats(inner(s, STATE.w), WORK.r2)
    free = naturals(m, MODEL.free)
    b[:] = 0.0
    for i in range(free.shape[0]):
        b[i] = -r2[free[i]]
    run_part(m, s, PARTS.rate_solution)
    if not _change(m, s) < math.inf:
        return False
    _take_rates(m, s)
    return True

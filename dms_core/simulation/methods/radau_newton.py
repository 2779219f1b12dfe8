"""Simplified Newton iteration for the three stages of a Radau step (Hairer and Wanner 1996, IV.8).

In W = T^-1 Y it solves one real and one complex system, both of the size of a single stage and scaled as in newton.py.
The scaled matrices hardly depend on h, so that they are kept over changes of the step while the iteration contracts.
"""

import math

from dms_core.assembly.tables import MODEL, WORK
from dms_core.compiled.arena import complexes, floats, inner, ints, matrix, naturals
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.newton import NEWTON, closing_correction, failure, largest_errors, refresh
from dms_core.simulation.iteration.parts import PARTS, run_part
from dms_core.simulation.methods.radau_constants import COMPLEX, REAL, STAGES, T_INVERSE, T
from dms_core.simulation.methods.radau_stages import evaluate_stages, guess_stages, put_stage
from dms_core.simulation.methods.radau_state import RADAU
from dms_core.simulation.state import CLOCK, COUNTS, STATE

MAX_ITERATIONS = 10
MAX_FIXED_ITERATIONS = 40
"""Where the step is fixed, so that a slow iteration cannot be helped by a shorter one."""
MAX_CLOSINGS = 20
MIDDLE = 1
"""Stage at whose guess the matrices are evaluated: it lies nearest to the middle of the step."""
KEEP = 0.02
"""Contraction up to which the matrices serve the next step, too."""
C0_CHANGE = 0.5
"""Relative change of c0 up to which old matrices are tried."""
STALLED = 0.8
"""Contraction from which on corrections are taken for rounding, if they are small."""
ROUNDING = 1e-15
"""Of values of size 1: corrections need not be smaller."""


@compiled
def right_hand_sides(m, s, c0):
    """b of both systems: T^-1 times the residuals of the stages, rows scaled by 1/c, 1/c^2, 1, 1/c."""
    radau, b = inner(s, STATE.radau), floats(s, STATE.b)
    R, bc = matrix(radau, RADAU.residual), complexes(radau, RADAU.b)
    n, k = naturals(m, MODEL.free).shape[0], naturals(m, MODEL.active).shape[0]
    h, hc = 1.0 / c0, 1.0 / (c0 / REAL * COMPLEX)
    (r0, r1, r2), (u0, u1, u2), (w0, w1, w2) = T_INVERSE
    for j in range(2 * n + 2 * k):
        x = r0 * R[0, j] + r1 * R[1, j] + r2 * R[2, j]
        z = complex(u0 * R[0, j] + u1 * R[1, j] + u2 * R[2, j], w0 * R[0, j] + w1 * R[1, j] + w2 * R[2, j])
        if j < n or j >= 2 * n + k:
            b[j], bc[j] = h * x, hc * z
        elif j < 2 * n:
            b[j], bc[j] = h * h * x, hc * hc * z
        else:
            b[j], bc[j] = x, z


@compiled
def _add(stages, c, real, pair):
    """Add T (real, Re pair, Im pair) to coordinate or row c of the stages; gives the largest change."""
    largest = 0.0
    for i in range(STAGES):
        t = T[i]
        change = t[0] * real + t[1] * pair.real + t[2] * pair.imag
        stages[i, c] += change
        # What is not finite counts as the largest; max() may lose it.
        if not abs(change) <= largest:
            largest = abs(change)
    return largest


@compiled
def apply_corrections(m, s, c0):
    """Add the corrections of both systems to the stages; gives their largest weighted component in q and v."""
    radau = inner(s, STATE.radau)
    free, active = naturals(m, MODEL.free), naturals(m, MODEL.active)
    x, xc = floats(s, STATE.x), complexes(radau, RADAU.x)
    wq, wv = floats(s, STATE.wq), floats(s, STATE.wv)
    q, v = matrix(radau, RADAU.q), matrix(radau, RADAU.v)
    lam, mu = matrix(radau, RADAU.lam), matrix(radau, RADAU.mu)
    n, k, cc, largest = free.shape[0], active.shape[0], c0 / REAL * COMPLEX, 0.0
    for j in range(n):
        c = free[j]
        size = _add(q, c, x[j], xc[j]) / wq[c]
        size_v = _add(v, c, c0 * x[n + j], cc * xc[n + j]) / wv[c]
        if not size + size_v < math.inf:
            return math.inf
        largest = max(largest, max(size, size_v))
    for j in range(k):
        a = active[j]
        _add(lam, a, c0 * c0 * x[2 * n + j], cc * cc * xc[2 * n + j])
        _add(mu, a, c0 * x[2 * n + k + j], cc * xc[2 * n + k + j])
    return largest


@compiled
def tolerance(o):
    """Largest error that the iteration may leave: the method errs much less than its estimate says (RADAU5: kappa)."""
    rtol = o.rtol ** (2.0 / 3.0)
    return min(o.newton_tol, max(math.sqrt(rtol), 10.0 * ROUNDING / rtol))


@compiled
def close_constraints(m, s, o, c0):
    """Bring phi and phi_q v of the iterate below constraint_tol, with corrections that leave r1 and r2 alone.

    Where rounding does not allow that for velocities, c0 times positions, what a stage of the other methods may leave
    is allowed. False if they resist.
    """
    w, x, free = inner(s, STATE.w), floats(s, STATE.x), naturals(m, MODEL.free)
    q, v = floats(w, WORK.q), floats(w, WORK.v)
    n, before = free.shape[0], math.inf
    for closing in range(MAX_CLOSINGS):
        run_part(m, s, PARTS.constraints)
        error, error_v = largest_errors(s)
        if error <= o.constraint_tol:
            rounding = closing > 1 and error_v > STALLED * before
            if error_v <= o.constraint_tol * (max(1.0, 1e-3 * c0) if rounding else 1.0):
                return True
        before = error_v
        closing_correction(m, s, c0)
        for i in range(n):
            q[free[i]] += x[i]
            v[free[i]] += c0 * x[n + i]
    return False


@compiled
def iterate(m, s, o, t, h, fresh):
    """The iteration from the guess at hand; gives (code, iterations)."""
    clock, count, c0 = floats(s, STATE.clock), ints(s, STATE.counts), REAL / h
    contraction, before, enough = clock[CLOCK.contraction], 0.0, tolerance(o)
    failed = NEWTON.diverged if fresh else NEWTON.stale_matrix
    most = MAX_FIXED_ITERATIONS if fresh and o.fixed_step > 0.0 else MAX_ITERATIONS
    for k in range(most):
        evaluate_stages(m, s, t, h)
        right_hand_sides(m, s, c0)
        run_part(m, s, PARTS.radau_solutions)
        count[COUNTS.iterations] += 1
        norm = apply_corrections(m, s, c0)
        if not norm < math.inf:
            return (NEWTON.not_finite if fresh else NEWTON.stale_matrix), k + 1
        stalled = False
        if k > 0:
            ratio = norm / before if before > 0.0 else 0.0
            stalled = ratio > STALLED and norm < o.newton_tol
            if ratio >= 1.0 and not stalled:
                return failed, k + 1
            contraction = min(ratio, 0.99)
        left = norm * (contraction / (1.0 - contraction) if k > 0 else 3.0 * max(contraction, KEEP))
        if stalled or left < enough:
            clock[CLOCK.contraction] = contraction if not stalled else KEEP
            if k > 0 and contraction > KEEP and not stalled:
                count[COUNTS.stale] = 1
            return NEWTON.converged, k + 1
        rest = left * contraction ** (most - 1 - k)
        if k > 0 and rest > o.newton_tol or k >= 3 and not fresh and contraction > 0.2:
            return failed, k + 1
        before = norm
    return failed, most


@compiled
def solve_stages(m, s, o, t, h, started):
    """All stages of a step from their guess; gives (code, iterations).

    Old matrices that do not contract are renewed once.
    """
    clock, count, c0 = floats(s, STATE.clock), ints(s, STATE.counts), REAL / h
    count[COUNTS.age] += 1
    guess_stages(m, s, h, started)
    code, iterations = NEWTON.stale_matrix, 0
    if count[COUNTS.stale] == 0 and abs(c0 / clock[CLOCK.c0_factored] - 1.0) <= C0_CHANGE:
        code, iterations = iterate(m, s, o, t, h, False)
        if code == NEWTON.stale_matrix:
            guess_stages(m, s, h, started)
    if code == NEWTON.stale_matrix:
        put_stage(m, s, MIDDLE, t, h)
        if not refresh(m, s, c0, PARTS.radau_matrices):
            return failure(s), iterations
        code, more = iterate(m, s, o, t, h, True)
        iterations += more
    return code, iterations

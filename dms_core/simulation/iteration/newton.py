"""Newton's method with line search for one stage of the implicit method (paper sect. 2.3).

The stage is qdot = c0 q + cq, vdot = c0 v + cv in the residual of eq. 2. The factorised matrix is kept while the
iteration contracts; corrections of a step that does not reduce the simplified Newton correction are halved
(natural monotonicity test: Deuflhard 2011, sect. 3.3), which is a line search in an affine-invariant norm.
"""

import math
from typing import NamedTuple

from dms_core.assembly.tables import MODEL, WORK
from dms_core.compiled.arena import fields, floats, inner, ints, naturals
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.order_watch import nearly_singular
from dms_core.simulation.iteration.parts import PARTS, SINGULAR_PIVOT, run_part
from dms_core.simulation.state import CLOCK, COUNTS, LARGEST, STATE, begin_matrix


class Newton(NamedTuple):
    """How the iteration for a stage ended."""

    converged: int
    stale_matrix: int
    """The old matrix does not contract; it is to be renewed."""
    diverged: int
    singular: int
    not_finite: int
    """The residual is no number."""


NEWTON = fields(Newton)

MAX_ITERATIONS = 10
MAX_HALVINGS = 5
MAX_CLOSINGS = 6
SLOW = 0.05
"""Contraction above which an old matrix is not worth keeping, and below which no other is trusted before it is seen."""
ROUNDING = 100.0
"""Correction, over the local error allowed, below which one that no longer shrinks beside a singular position is
rounding: that of phi, 1e-16, comes back divided by the square of the smallest singular value of phi_q."""
C0_CHANGE = 0.1
"""Relative change of c0 up to which an old matrix is tried; the scaled matrix depends on c0 only weakly."""


@compiled
def set_rates(s, c0):
    """vdot = c0 v + cv at the present iterate."""
    w, cv = inner(s, STATE.w), floats(s, STATE.cv)
    a, v = floats(w, WORK.a), floats(w, WORK.v)
    for i in range(cv.shape[0]):
        a[i] = c0 * v[i] + cv[i]


@compiled
def right_hand_side(m, s, c0):
    """b = -(r1 / c0, r2 / c0^2, r3, r4 / c0), from the evaluated residual."""
    w, b, cq = inner(s, STATE.w), floats(s, STATE.b), floats(s, STATE.cq)
    free, active = naturals(m, MODEL.free), naturals(m, MODEL.active)
    q, v, gmu, r2 = floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.gmu), floats(w, WORK.r2)
    phi, phi_v = floats(w, WORK.phi), floats(w, WORK.phi_v)
    n, k, h = free.shape[0], active.shape[0], 1.0 / c0
    for j in range(n):
        i = free[j]
        b[j] = -h * (v[i] - c0 * q[i] - cq[i] - gmu[i])
        b[n + j] = -h * h * r2[i]
    for i in range(k):
        b[2 * n + i] = -phi[active[i]]
        b[2 * n + k + i] = -h * phi_v[active[i]]


@compiled
def apply(m, s, c0, x, factor):
    """Add factor times the scaled correction x to q, v, lam, mu."""
    w, free, active = inner(s, STATE.w), naturals(m, MODEL.free), naturals(m, MODEL.active)
    q, v, lam, mu = floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.lam), floats(w, WORK.mu)
    n, k = free.shape[0], active.shape[0]
    for i in range(n):
        q[free[i]] += factor * x[i]
        v[free[i]] += factor * c0 * x[n + i]
    for i in range(k):
        lam[active[i]] += factor * c0 * c0 * x[2 * n + i]
        mu[active[i]] += factor * c0 * x[2 * n + k + i]
    set_rates(s, c0)


@compiled
def correction_norm(m, s, c0):
    """Largest weighted component of the correction x in q and v, inf if any is not finite."""
    x, wq, wv, free = floats(s, STATE.x), floats(s, STATE.wq), floats(s, STATE.wv), naturals(m, MODEL.free)
    n, largest = free.shape[0], 0.0
    for i in range(n):
        # A division takes as long as all else here; what is no number fails the comparison, too.
        if not abs(x[i]) <= largest * wq[free[i]]:
            largest = abs(x[i]) / wq[free[i]]
        if not abs(c0 * x[n + i]) <= largest * wv[free[i]]:
            largest = abs(c0 * x[n + i]) / wv[free[i]]
        if not largest < math.inf:
            return math.inf
    return largest


@compiled
def refresh(m, s, c0, part):
    """Evaluate residual and matrix here and factorise; False if the matrix is singular.

    `part` does it: PARTS.newton_matrix, or PARTS.radau_matrices for the two of Radau IIA.
    """
    begin_matrix(s, c0)
    run_part(m, s, part)
    return floats(s, STATE.clock)[CLOCK.pivot] > SINGULAR_PIVOT


@compiled
def correction(m, s, c0):
    """Newton correction x at the present iterate, with the matrix at hand; gives its norm."""
    right_hand_side(m, s, c0)
    run_part(m, s, PARTS.newton_solution)
    ints(s, STATE.counts)[COUNTS.iterations] += 1
    return correction_norm(m, s, c0)


@compiled
def largest_errors(s):
    """Largest |phi| and |phi_q v + phi_t| of the last evaluation over all rows, inf if any is not finite."""
    w = inner(s, STATE.w)
    phi, phi_v = floats(w, WORK.phi), floats(w, WORK.phi_v)
    largest, largest_v = 0.0, 0.0
    for k in range(phi.shape[0]):
        if not abs(phi[k]) + abs(phi_v[k]) < math.inf:
            return math.inf, math.inf
        largest = max(largest, abs(phi[k]))
        largest_v = max(largest_v, abs(phi_v[k]))
    return largest, largest_v


@compiled
def failure(s):
    """Why `refresh` failed: not finite (a smaller step may help) or singular."""
    total = 0.0
    for x in floats(inner(s, STATE.w), WORK.r2):
        total += abs(x)
    phi, phi_v = largest_errors(s)
    return NEWTON.singular if total + phi + phi_v < math.inf else NEWTON.not_finite


@compiled
def note_errors(s):
    """Keep the largest constraint errors and |mu| of the run."""
    largest, mu = floats(s, STATE.largest), floats(inner(s, STATE.w), WORK.mu)
    phi, phi_v = largest_errors(s)
    largest[LARGEST.phi] = max(largest[LARGEST.phi], phi)
    largest[LARGEST.phi_v] = max(largest[LARGEST.phi_v], phi_v)
    for k in range(mu.shape[0]):
        largest[LARGEST.mu] = max(largest[LARGEST.mu], abs(mu[k]))


@compiled
def line_search(m, s, c0, before):
    """Halve the last correction until the simplified one shrinks; gives its norm, inf when it never does."""
    share = 1.0
    for _ in range(MAX_HALVINGS):
        share *= 0.5
        apply(m, s, c0, floats(s, STATE.x_before), -share)
        run_part(m, s, PARTS.residual)
        norm = correction(m, s, c0)
        if norm < before:
            return norm
    return math.inf


@compiled
def closing_correction(m, s, c0):
    """Correction x that brings phi and phi_q v, as evaluated, to 0 and leaves r1 and r2 alone."""
    w, b, active = inner(s, STATE.w), floats(s, STATE.b), naturals(m, MODEL.active)
    phi, phi_v = floats(w, WORK.phi), floats(w, WORK.phi_v)
    n, k = naturals(m, MODEL.free).shape[0], active.shape[0]
    b[: 2 * n] = 0.0
    for i in range(k):
        b[2 * n + i] = -phi[active[i]]
        b[2 * n + k + i] = -phi_v[active[i]] / c0
    run_part(m, s, PARTS.newton_solution)


@compiled
def close_constraints(m, s, o, c0):
    """Bring phi and phi_q v below their tolerance by corrections that leave r1 and r2 alone; False if they resist.

    Newton's test looks at the tolerance of the run; constraints are to hold much better. Their rows alone are evaluated
    and solved for with the matrix at hand, at a third of the cost of a full iteration. Velocities are of the size of c0
    times positions, and so is their tolerance.
    """
    for _ in range(MAX_CLOSINGS):
        run_part(m, s, PARTS.constraints)
        error, error_v = largest_errors(s)
        if error <= o.constraint_tol and error_v <= o.constraint_tol * max(1.0, 1e-3 * c0):
            return True
        closing_correction(m, s, c0)
        apply(m, s, c0, floats(s, STATE.x), 1.0)
    return False


@compiled
def newton(m, s, o, c0, close):
    """Solve the stage from the guess in w; `close` brings the constraints to their tolerance. Gives (code, iterations).

    NEWTON.stale_matrix asks the caller to put the guess back and to call again with a stale matrix noted in the counts.
    """
    clock, count, x, x_before = (
        floats(s, STATE.clock),
        ints(s, STATE.counts),
        floats(s, STATE.x),
        floats(s, STATE.x_before),
    )
    set_rates(s, c0)
    fresh = count[COUNTS.stale] == 1 or abs(c0 / clock[CLOCK.c0_factored] - 1.0) > C0_CHANGE
    if fresh:
        if not refresh(m, s, c0, PARTS.newton_matrix):
            return failure(s), 0
    else:
        run_part(m, s, PARTS.residual)
    contraction, before = clock[CLOCK.contraction], 0.0
    for k in range(MAX_ITERATIONS):
        norm = correction(m, s, c0)
        if not norm < math.inf:
            return (NEWTON.not_finite if fresh else NEWTON.stale_matrix), k
        if k > 1 and fresh and 0.5 * before < norm < ROUNDING and nearly_singular(s):
            if not close or close_constraints(m, s, o, c0):
                return NEWTON.converged, k + 1
        if k > 0:
            if norm > before and norm > o.newton_tol:
                if not fresh:
                    return NEWTON.stale_matrix, k
                norm = line_search(m, s, c0, before)
                if not norm < math.inf:
                    return NEWTON.diverged, k
            contraction = min(norm / before, 0.99) if before > 0.0 else 0.0
        apply(m, s, c0, x, 1.0)
        # What is left after this correction; before a second one, the contraction of earlier steps is a guess only.
        left = norm * (contraction / (1.0 - contraction) if k > 0 else 3.0 * max(contraction, SLOW))
        if left < o.newton_tol and (not close or close_constraints(m, s, o, c0)):
            clock[CLOCK.contraction] = contraction
            if k > 1 and contraction > SLOW:
                count[COUNTS.stale] = 1
            return NEWTON.converged, k + 1
        if k >= 3 and not fresh and contraction > SLOW:
            return NEWTON.stale_matrix, k
        for i in range(x.shape[0]):
            x_before[i] = x[i]
        before = norm
        rest = norm * contraction ** (MAX_ITERATIONS - 1 - k) / (1.0 - contraction)
        if k > 0 and fresh and rest > o.newton_tol:
            # Too slow to end in time (Hairer and Wanner 1996, IV.8), as where a kink lies between guess and solution: a
            # fibre that stops shortening needs the matrix of the far side.
            if not refresh(m, s, c0, PARTS.newton_matrix):
                return failure(s), k
        else:
            run_part(m, s, PARTS.residual)
    return (NEWTON.diverged if fresh else NEWTON.stale_matrix), MAX_ITERATIONS

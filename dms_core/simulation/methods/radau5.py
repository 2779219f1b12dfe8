"""One step of Radau IIA of order 5 in the stabilised form, its local error and the size of the next step.

The method is that of Hairer and Wanner (1996, IV.8; for index 2, VII.4): positions, velocities and element states are
of order 5 at the ends of steps, multipliers of order 3 (a record gets those that belong to q and v, of order 5). The
error estimate is that of an embedded formula of order 3, put through the matrix of the step,

    err = -A(c0)^-1 R(t_n, y_n, ydot = -(e_1 Z_1 + e_2 Z_2 + e_3 Z_3) / h),

so that whatever a multiplier can take up is no error; multipliers themselves are not part of it.
"""

import math

from dms_core.assembly.tables import MODEL, WORK
from dms_core.compiled.arena import flags, floats, inner, ints, matrix, naturals
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.newton import NEWTON
from dms_core.simulation.iteration.parts import PARTS, run_part, set_inputs
from dms_core.simulation.methods.radau_constants import ERROR, ORDER_OF_ERROR, REAL, STAGES
from dms_core.simulation.methods.radau_newton import MAX_ITERATIONS, close_constraints, solve_stages
from dms_core.simulation.methods.radau_stages import rate, remember_stages, take_last_stage
from dms_core.simulation.methods.radau_state import CONTROL, RADAU
from dms_core.simulation.state import CLOCK, COUNTS, STATE

SAFETY, SHRINK, GROW = 0.9, 0.2, 8.0
CONTRACTING = 0.4
"""Contraction that the iteration should show with matrices made for the step: a larger step would end in failures."""
PROJECTED = 0.1
"""Share of what the projection moves that counts as error: most of it is none at the end of the step."""
LEAST_ERROR = 1e-2
"""Error that a step is taken to have made at least when the next one is predicted."""


@compiled
def _embedded(stage, start, k, h):
    """Rate of coordinate k in the embedded formula."""
    y = start[k]
    return -(ERROR[0] * (stage[0, k] - y) + ERROR[1] * (stage[1, k] - y) + ERROR[2] * (stage[2, k] - y)) / h


@compiled
def _put_begin(s, h, shifted):
    """Begin of the step into the iterate, `shifted` by the error in cq and cv, with the rates of that formula."""
    w, radau = inner(s, STATE.w), inner(s, STATE.radau)
    q, v, a, lam, mu = (
        floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.a), floats(w, WORK.lam), floats(w, WORK.mu),
    )  # fmt: skip
    q_n, v_n, lam_n = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.lam)
    stage_v, error_q, error_v = matrix(radau, RADAU.v), floats(s, STATE.cq), floats(s, STATE.cv)
    for k in range(q_n.shape[0]):
        q[k], v[k] = q_n[k], v_n[k]
        if shifted:
            q[k] += error_q[k]
            v[k] += error_v[k]
        a[k] = _embedded(stage_v, v_n, k, h)
    for k in range(lam_n.shape[0]):
        lam[k], mu[k] = lam_n[k], 0.0


@compiled
def _error(m, s, h, shifted):
    """The estimate into cq and cv; gives its largest weighted component."""
    w, b, x, c0 = inner(s, STATE.w), floats(s, STATE.b), floats(s, STATE.x), REAL / h
    free, second = naturals(m, MODEL.free), flags(m, MODEL.second)
    v, gmu, r2 = floats(w, WORK.v), floats(w, WORK.gmu), floats(w, WORK.r2)
    stage_q, q_n = matrix(inner(s, STATE.radau), RADAU.q), floats(s, STATE.q)
    wq, wv = floats(s, STATE.wq), floats(s, STATE.wv)
    error_q, error_v = floats(s, STATE.cq), floats(s, STATE.cv)
    _put_begin(s, h, shifted)
    set_inputs(m, s, floats(s, STATE.clock)[CLOCK.t], False)
    run_part(m, s, PARTS.residual)
    n, largest = free.shape[0], 0.0
    b[:] = 0.0
    for j in range(n):
        c = free[j]
        b[j] = -(v[c] - _embedded(stage_q, q_n, c, h) - gmu[c]) / c0
        b[n + j] = -r2[c] / (c0 * c0)
    run_part(m, s, PARTS.newton_solution)
    for j in range(n):
        c = free[j]
        error_q[c], error_v[c] = x[j], c0 * x[n + j]
        size = abs(error_q[c]) / wq[c]
        if second[c]:
            size = max(size, abs(error_v[c]) / wv[c])
        if not size < math.inf or not error_v[c] < math.inf:
            return math.inf
        largest = max(largest, size)
    return largest


@compiled
def _projection(m, s, h):
    """Largest weighted h |v - qdot| = h |phi_q^T mu| of the stages: how far the projection moves positions in a step.

    The estimate above says nothing where constraints alone rule the motion, as in a linkage that is driven: there it is
    0 at any step, even one that ends in another closure of the loop. This goes with h^4, too.
    """
    radau, second, wq = inner(s, STATE.radau), flags(m, MODEL.second), floats(s, STATE.wq)
    stage_q, stage_v, q_n = matrix(radau, RADAU.q), matrix(radau, RADAU.v), floats(s, STATE.q)
    largest = 0.0
    for i in range(STAGES):
        for k in range(q_n.shape[0]):
            if second[k]:
                largest = max(largest, h * abs(stage_v[i, k] - rate(i, stage_q, q_n, k, h)) / wq[k])
    return largest


@compiled
def _next_size(s, h, error, iterations):
    """Size of the step behind an accepted one, from its error and that of the step before (Gustafsson 1994).

    Where matrices of this very step contracted slowly, it is that at which they would do better: contraction goes with
    the change of phi_q over a step. There is no zone in which h is left alone: see step_control.py, and the matrices
    are kept over small changes anyway.
    """
    clock, control = floats(s, STATE.clock), floats(inner(s, STATE.radau), RADAU.control)
    effort = (1.0 + 2.0 * MAX_ITERATIONS) / (iterations + 2.0 * MAX_ITERATIONS)
    error = max(error, 1e-10)
    factor = SAFETY * effort * error ** (-1.0 / ORDER_OF_ERROR)
    before = control[CONTROL.error_before]
    if before > 0.0:
        predicted = h / control[CONTROL.h_before] * (before / (error * error)) ** (1.0 / ORDER_OF_ERROR)
        factor = min(factor, SAFETY * predicted)
    if ints(s, STATE.counts)[COUNTS.age] == 0:
        factor = min(factor, CONTRACTING / max(clock[CLOCK.contraction], 1e-3))
    return h * min(GROW, max(SHRINK, factor))


@compiled
def radau5_step(m, s, o, h):
    """One step of size h into w. Gives (code, iterations, weighted local error).

    Where the error is small enough, control[CONTROL.wanted] is the size that the next step should have.
    """
    t, control = floats(s, STATE.clock)[CLOCK.t], floats(inner(s, STATE.radau), RADAU.control)
    started = ints(s, STATE.counts)[COUNTS.restart] == 1
    if started:
        control[CONTROL.error_before] = 0.0
    code, iterations = solve_stages(m, s, o, t, h, started)
    if code != NEWTON.converged:
        return code, iterations, 0.0
    error = _error(m, s, h, False)
    if error > 1.0 and (started or control[CONTROL.rejected] == 1.0):
        error = _error(m, s, h, True)
    error = max(error, PROJECTED * _projection(m, s, h))
    control[CONTROL.rejected] = 1.0 if error > 1.0 else 0.0
    if error > 1.0 and not o.fixed_step > 0.0:
        return code, iterations, error
    take_last_stage(s, h, REAL / h)
    set_inputs(m, s, t + h, True)
    if not close_constraints(m, s, o, REAL / h):
        return NEWTON.diverged, iterations, error
    control[CONTROL.wanted] = _next_size(s, h, error, iterations)
    control[CONTROL.error_before] = max(error, LEAST_ERROR)
    remember_stages(s, h)
    return code, iterations, error

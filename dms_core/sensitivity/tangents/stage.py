"""The implicit function theorem at one implicit stage: qdot = c0 q + cq, vdot = c0 v + cv in the residual of eq. 2.

With A the Newton matrix at the converged stage, evaluated and factorised anew there,

    A d(q, v, lam, mu) = (dcq, -r2_a dcv - r2_u du, -r3_u du, -r4_u du) - r_p dp

and by the transpose, of derivatives g by (q, v, lam, mu), with A^T psi = g:

    by cq: psi_1      by cv: -r2_a^T psi_2      by u: -r2_u^T psi_2 - r3_u^T psi_3 - r4_u^T psi_4

The matrix of a step leaves out (phi_q^T mu)_q in r1; mu is of the size of the local error, and what it does is made up
for by repeated solves, x <- A^-1 (b + (phi_q^T mu)_q x), each of which gains the factor |(phi_q^T mu)_q| / c0.
"""

import math

from dms_core.assembly.derivatives.blocks import scatter_projection
from dms_core.assembly.derivatives.input_derivatives import constraint_by_input, dynamic_by_input
from dms_core.assembly.local import (
    add_constraint_forces,
    add_dynamic_rows,
    evaluate_constraint,
    evaluate_dynamic,
    put_constraint_values,
    views,
)
from dms_core.assembly.residual import evaluate_residual
from dms_core.assembly.scatter import BLOCKS, begin_newton, scatter_constraint, scatter_dynamic, scatter_part
from dms_core.assembly.tables import CALLS, MODEL, WORK
from dms_core.compiled.arena import floats, indices, inner, ints, matrix, naturals, table_at
from dms_core.compiled.entries import SLOPES
from dms_core.compiled.jit import compiled
from dms_core.sensitivity.tangents.tables import DIFFERENTIALS, MOVEMENT, NUMBERS, Movement
from dms_core.sensitivity.tangents.tables import STAGE as AT
from dms_core.simulation.iteration.implicit_stage import LOCAL_SHARE
from dms_core.simulation.iteration.linear_solve import back_substitute, factorise
from dms_core.simulation.iteration.newton import apply, correction, correction_norm, right_hand_side
from dms_core.simulation.iteration.parts import PARTS, SINGULAR_PIVOT, run_part
from dms_core.simulation.state import STATE, begin_matrix

PASSES = 4
POLISHINGS = 6
STALLED = 0.1
"""Share of the correction before above which one is rounding."""
LEFT = 1e-14
"""Share of a solution that repeated solves leave of what the Newton matrix lacks."""
MOST_SWEEPS = 12
MOVEMENT_FIELDS = len(Movement._fields)


@compiled
def evaluate_stage(m, s, d, g, c0):
    """Residual, Newton matrix, r2_a and (phi_q^T mu)_q at the iterate, in one pass over the elements."""
    w, pattern, blocks = inner(s, STATE.w), inner(m, MODEL.newton), inner(d, DIFFERENTIALS.pattern)
    dynamics, constraints = inner(m, MODEL.dynamics), inner(m, MODEL.constraints)
    values, by_a, by_mu = floats(g, AT.factors), floats(g, AT.by_a), floats(g, AT.by_mu)
    x, y = views(dynamics, w), views(constraints, w)
    x.r2[:] = 0.0
    x.gmu[:] = 0.0
    by_a[:] = 0.0
    by_mu[:] = 0.0
    begin_newton(pattern, values)
    for e in ints(dynamics, CALLS.moving):
        n = evaluate_dynamic(x, dynamics, e, w, 1)
        add_dynamic_rows(x, e, n)
        scatter_dynamic(pattern, e, w, 1.0 / c0, values)
        scatter_part(inner(blocks, BLOCKS.Ja), e, matrix(w, WORK.Ja), 1.0, by_a)
    for e in ints(constraints, CALLS.moving):
        n = evaluate_constraint(y, constraints, e, w, 1)
        put_constraint_values(y, e, n)
        add_constraint_forces(y, e, n)
        scatter_constraint(pattern, e, w, 1.0 / c0, values)
        scatter_projection(y, constraints, blocks, e, w, n, by_mu)


@compiled
def _count_sweeps(d, g, c0):
    """Solves behind the first that the left-out term asks for."""
    by_mu, rows, sums = floats(g, AT.by_mu), indices(d, DIFFERENTIALS.mu_rows), floats(d, DIFFERENTIALS.full)
    sums[:] = 0.0
    for e in range(rows.shape[0]):
        sums[rows[e]] += abs(by_mu[e])
    largest = 0.0
    for size in sums:
        largest = max(largest, size / c0)
    count = 0
    if largest > 0.0:
        count = MOST_SWEEPS if largest > 0.1 else min(MOST_SWEEPS, int(math.ceil(math.log(LEFT) / math.log(largest))))
        count = 0 if largest < LEFT else count
    ints(g, AT.sweeps)[0] = count


@compiled
def _by_inputs(m, s, d, g):
    """r2, r3, r4 by the inputs."""
    w, slopes, scratch = inner(s, STATE.w), inner(d, DIFFERENTIALS.slopes), matrix(d, DIFFERENTIALS.scratch)
    dynamics, constraints = inner(m, MODEL.dynamics), inner(m, MODEL.constraints)
    r2, r3, r4 = matrix(g, AT.r2_u), matrix(g, AT.r3_u), matrix(g, AT.r4_u)
    r2[:, :] = 0.0
    r3[:, :] = 0.0
    r4[:, :] = 0.0
    kernels, Ju = ints(d, DIFFERENTIALS.kernels), matrix(slopes, SLOPES.Ju)
    iq, iq_ptr = naturals(dynamics, CALLS.iq), ints(dynamics, CALLS.iq_ptr)
    iu, iu_ptr = naturals(dynamics, CALLS.iu), ints(dynamics, CALLS.iu_ptr)
    for e in ints(d, DIFFERENTIALS.reading):
        dynamic_by_input(dynamics, kernels, e, w, slopes)
        first = iq_ptr[e]
        for k in range(iu_ptr[e + 1] - iu_ptr[e]):
            for j in range(3):
                into = 3 * iu[iu_ptr[e] + k] + j
                for i in range(iq_ptr[e + 1] - first):
                    r2[into, iq[first + i]] += Ju[i, 3 * k + j]
    row, iu, iu_ptr = ints(constraints, CALLS.row), naturals(constraints, CALLS.iu), ints(constraints, CALLS.iu_ptr)
    for e in ints(d, DIFFERENTIALS.driven):
        rows, inputs = row[e + 1] - row[e], iu_ptr[e + 1] - iu_ptr[e]
        constraint_by_input(constraints, e, w, scratch)
        for k in range(inputs):
            into = 3 * iu[iu_ptr[e] + k]
            for i in range(rows):
                r3[into, row[e] + i] += scratch[i, k]
                r4[into + 1, row[e] + i] += scratch[i, k]
                r4[into, row[e] + i] += scratch[rows + i, k]


@compiled
def _note_rows(w, r, sign, factor, n, k):
    """r = factor (r + sign times the evaluated rows)."""
    gmu, r2, phi, phi_v = floats(w, WORK.gmu), floats(w, WORK.r2), floats(w, WORK.phi), floats(w, WORK.phi_v)
    for i in range(n):
        r[i] = factor * (r[i] - sign * gmu[i])
        r[n + i] = factor * (r[n + i] + sign * r2[i])
    for i in range(k):
        r[2 * n + i] = factor * (r[2 * n + i] + sign * phi[i])
        r[2 * n + k + i] = factor * (r[2 * n + k + i] + sign * phi_v[i])


@compiled
def _by_numbers(s, d, g):
    """All rows by the declared numbers: central differences of the elements that each of them moves."""
    w, movements, r_p = inner(s, STATE.w), ints(d, DIFFERENTIALS.movements), matrix(g, AT.r_p)
    n, k = floats(s, STATE.q).shape[0], floats(s, STATE.lam).shape[0]
    r_p[:, :] = 0.0
    for j in range(movements.shape[0]):
        move = table_at(movements[j], MOVEMENT_FIELDS)
        evaluate_residual(inner(move, MOVEMENT.high_dynamics), inner(move, MOVEMENT.high_constraints), w)
        _note_rows(w, r_p[j], 1.0, 1.0, n, k)
        evaluate_residual(inner(move, MOVEMENT.low_dynamics), inner(move, MOVEMENT.low_constraints), w)
        _note_rows(w, r_p[j], -1.0, 0.5 / floats(move, MOVEMENT.step)[0], n, k)


@compiled
def _polish(m, s, c0, close):
    """Corrections with the matrix at hand until they are smaller than `close`, or no longer shrink."""
    before = math.inf
    for _ in range(POLISHINGS):
        run_part(m, s, PARTS.residual)
        norm = correction(m, s, c0)
        if not norm < before:
            return
        apply(m, s, c0, floats(s, STATE.x), 1.0)
        if norm < close or norm > STALLED * before:
            return
        before = norm


@compiled
def _keep_factors(s, values, c0):
    """The factors of this stage serve the next one's iteration."""
    kept = floats(s, STATE.newton_values)
    for i in range(kept.shape[0]):
        kept[i] = values[i]
    begin_matrix(s, c0)


@compiled
def differentiate_stage(m, s, o, d, g, c0):
    """Bring the stage in w to its converged point and differentiate it there; False where its matrix is singular.

    The iterate is the one that the method accepted, within its Newton tolerance.
    """
    values, work = floats(g, AT.factors), floats(d, DIFFERENTIALS.work)
    b, x = floats(s, STATE.b), floats(s, STATE.x)
    close, before = floats(d, DIFFERENTIALS.numbers)[NUMBERS.close] / (LOCAL_SHARE * o.rtol), math.inf
    _polish(m, s, c0, close)
    for _ in range(PASSES):
        evaluate_stage(m, s, d, g, c0)
        if not factorise(m, MODEL.newton_lu, values, work) > SINGULAR_PIVOT:
            return False
        right_hand_side(m, s, c0)
        back_substitute(m, MODEL.newton_lu, values, b, x, work)
        norm = correction_norm(m, s, c0)
        if not norm < math.inf:
            return False
        apply(m, s, c0, x, 1.0)
        if norm < close or norm > STALLED * before:
            break
        before = norm
    _keep_factors(s, values, c0)
    _count_sweeps(d, g, c0)
    _by_inputs(m, s, d, g)
    _by_numbers(s, d, g)
    return True

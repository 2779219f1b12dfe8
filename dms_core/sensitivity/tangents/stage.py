"""The implicit function theorem at one implicit stage: qdot = c0 q + cq, vdot = c0 v + cv in the residual of eq. 2.

With A the Newton matrix at the converged stage, evaluated and factorised anew there,

    A d(q, v, lam, mu) = (dcq, -r2_a dcv - r2_u du, -r3_u du, -r4_u du) - r_p dp

and by the transpose, of derivatives g by (q, v, lam, mu), with A^T psi = g:

    by cq: psi_1      by cv: -r2_a^T psi_2      by u: -r2_u^T psi_2 - r3_u^T psi_3 - r4_u^T psi_4

The matrix of a step leaves out (phi_q^T mu)_q in r1; mu is of the size of the local error, and what it does is made up
for by repeated solves, x <- A^-1 (b + (phi_q^T mu)_q x), each of which gains the factor |(phi_q^T mu)_q| / c0.
"""

import math
from typing import NamedTuple

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
from dms_core.compiled.arena import fields, floats, indices, inner, ints, matrix, naturals, table_at
from dms_core.compiled.entries import SLOPES
from dms_core.compiled.jit import compiled
from dms_core.sensitivity.tangents.tables import DIFFERENTIALS, MOVEMENT, NUMBERS, Movement
from dms_core.sensitivity.tangents.tables import STAGE as AT
from dms_core.simulation.iteration.implicit_stage import LOCAL_SHARE
from dms_core.simulation.iteration.linear_solve import back_substitute, factorise
from dms_core.simulation.iteration.newton import apply, correction, correction_norm, right_hand_side
from dms_core.simulation.iteration.parts import PARTS, SINGULAR_PIVOT, run_part
from dms_core.simulation.state import CLOCK, COUNTS, STATE, begin_matrix

PASSES = 4
POLISHINGS = 8
MORE = 4
"""Corrections that cost as much as other factors, which are taken where more than that would be needed."""
STALLED = 0.5
"""Contraction from which on, behind better ones, a correction is rounding."""
C0_CHANGE = 0.5
"""Relative change of c0 up to which old factors are tried; the scaled matrix depends on c0 only weakly."""
LEAST_FORCE = 1e-3
"""Multiplier [N] beside which one counts as 0."""
LEFT = 1e-14
"""Share of a solution that repeated solves leave of what the Newton matrix lacks."""
MOST_SWEEPS = 12
MOVEMENT_FIELDS = len(Movement._fields)


class Settled(NamedTuple):
    """How the iteration for a stage that is differentiated ended."""

    singular: int
    """Its matrix is singular, or not finite."""
    no: int
    """The matrix was taken at a point that is farther from the stage than was asked for."""
    yes: int


SETTLED = fields(Settled)


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
        # A solve leaves that share, and each repeated one as much of what was left.
        solves = MOST_SWEEPS if largest > 0.1 else int(math.ceil(math.log(LEFT) / math.log(largest)))
        count = min(MOST_SWEEPS, max(0, solves - 1))
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
def _has_factors(s, c0):
    """Whether the factors at hand are of a matrix that is like the one for c0."""
    usable = abs(c0 / floats(s, STATE.clock)[CLOCK.c0_factored] - 1.0) < C0_CHANGE
    return usable and ints(s, STATE.counts)[COUNTS.stale] == 0


@compiled
def _distance(m, s, o, c0):
    """As `correction_norm`, and of the multipliers, over their largest: derivatives of phi_q^T lam go with these."""
    x, lam, active = floats(s, STATE.x), floats(inner(s, STATE.w), WORK.lam), naturals(m, MODEL.active)
    n, size, change = naturals(m, MODEL.free).shape[0], LEAST_FORCE, 0.0
    for k in range(active.shape[0]):
        size = max(size, abs(lam[active[k]]))
        change = max(change, c0 * c0 * abs(x[2 * n + k]))
    return max(correction_norm(m, s, c0), change / (LOCAL_SHARE * o.rtol * size))


@compiled
def _polish(m, s, o, c0, close):
    """Corrections with the factors at hand; True where what is left is smaller than `close`, or rounding."""
    before, contracts = math.inf, False
    for k in range(POLISHINGS):
        run_part(m, s, PARTS.residual)
        norm = correction(m, s, c0)
        distance = _distance(m, s, o, c0)
        rounding = contracts or norm < close
        if not distance < before:
            return rounding and k > 0
        apply(m, s, c0, floats(s, STATE.x), 1.0)
        if k > 0:
            ratio = distance / before
            if distance * ratio < close or (rounding and ratio > STALLED):
                return True
            if distance * ratio**MORE > close:
                return False
            contracts = True
        before = distance
    return False


@compiled
def _keep_factors(s, values, c0):
    """The factors of this stage serve the next one's iteration."""
    kept = floats(s, STATE.newton_values)
    for i in range(kept.shape[0]):
        kept[i] = values[i]
    begin_matrix(s, c0)


@compiled
def differentiate_stage(m, s, o, d, g, c0):
    """Bring the stage in w to its converged point and differentiate it there; gives a place in Settled.

    The Newton matrix is evaluated and factorised once, at the converged point, where the factors at hand lead there: a
    correction with them costs a quarter of that.
    """
    values, work = floats(g, AT.factors), floats(d, DIFFERENTIALS.work)
    b, x, numbers, settled = floats(s, STATE.b), floats(s, STATE.x), floats(d, DIFFERENTIALS.numbers), SETTLED.no
    close = numbers[NUMBERS.close] / (LOCAL_SHARE * o.rtol)
    for _ in range(PASSES):
        if _has_factors(s, c0) and _polish(m, s, o, c0, close):
            settled = SETTLED.yes
            if numbers[NUMBERS.state_only] == 1.0:
                return settled
        evaluate_stage(m, s, d, g, c0)
        if not factorise(m, MODEL.newton_lu, values, work) > SINGULAR_PIVOT:
            return SETTLED.singular
        right_hand_side(m, s, c0)
        back_substitute(m, MODEL.newton_lu, values, b, x, work)
        distance = _distance(m, s, o, c0)
        if not distance < math.inf:
            return SETTLED.singular
        apply(m, s, c0, x, 1.0)
        _keep_factors(s, values, c0)
        if distance < close:
            settled = SETTLED.yes
        if settled == SETTLED.yes:
            break
    _count_sweeps(d, g, c0)
    _by_inputs(m, s, d, g)
    _by_numbers(s, d, g)
    return settled

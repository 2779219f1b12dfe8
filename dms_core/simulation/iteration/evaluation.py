"""What is evaluated and solved in a step, each of one packed model m and one packed world s; called by address."""

from dms_core.assembly.residual import (
    evaluate_both,
    evaluate_constraints,
    evaluate_inputs,
    evaluate_newton,
    evaluate_rates,
    evaluate_residual,
)
from dms_core.assembly.tables import MODEL
from dms_core.compiled.arena import floats, inner, ints
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.linear_solve import back_substitute, factorise
from dms_core.simulation.iteration.order_watch import note_pivot
from dms_core.simulation.iteration.parts import SINGULAR_PIVOT
from dms_core.simulation.state import CLOCK, COUNTS, STATE


@compiled
def inputs(m, s):
    """Inputs at clock[CLOCK.t_inputs], from the left or the right of a jump."""
    before = ints(s, STATE.counts)[COUNTS.before_jump] == 1
    evaluate_inputs(inner(s, STATE.signals), floats(s, STATE.clock)[CLOCK.t_inputs], before, inner(s, STATE.w))


@compiled
def residual(m, s):
    """The residual at the present iterate."""
    evaluate_residual(inner(m, MODEL.dynamics), inner(m, MODEL.constraints), inner(s, STATE.w))


@compiled
def constraints(m, s):
    """phi and phi_q v + phi_t at the present iterate."""
    evaluate_constraints(inner(m, MODEL.constraints), inner(s, STATE.w))


@compiled
def newton_matrix(m, s):
    """Residual, and the factorised Newton matrix for c0 = clock[CLOCK.c0_factored]; its pivot is noted."""
    clock, values, w = floats(s, STATE.clock), floats(s, STATE.newton_values), inner(s, STATE.w)
    dynamics, constraints = inner(m, MODEL.dynamics), inner(m, MODEL.constraints)
    evaluate_newton(dynamics, constraints, inner(m, MODEL.newton), w, clock[CLOCK.c0_factored], values)
    note_pivot(s, factorise(m, MODEL.newton_lu, values, floats(s, STATE.newton_work)))


@compiled
def newton_solution(m, s):
    """x from b."""
    values, work = floats(s, STATE.newton_values), floats(s, STATE.newton_work)
    back_substitute(m, MODEL.newton_lu, values, floats(s, STATE.b), floats(s, STATE.x), work)


@compiled
def rate_matrix(m, s):
    """Residual and factorised matrix of the acceleration problem; clock[CLOCK.pivot] is its smallest relative pivot."""
    values = floats(s, STATE.rate_values)
    dynamics, constraints = inner(m, MODEL.dynamics), inner(m, MODEL.constraints)
    evaluate_rates(dynamics, constraints, inner(m, MODEL.rates), inner(s, STATE.w), values)
    floats(s, STATE.clock)[CLOCK.pivot] = factorise(m, MODEL.rate_lu, values, floats(s, STATE.rate_work))


@compiled
def rate_solution(m, s):
    """rate_x from rate_b."""
    values, work = floats(s, STATE.rate_values), floats(s, STATE.rate_work)
    back_substitute(m, MODEL.rate_lu, values, floats(s, STATE.rate_b), floats(s, STATE.rate_x), work)


@compiled
def both_matrices(m, s):
    """As rate_matrix, and the factorised Newton matrix for c0 = clock[CLOCK.c0_factored] of the same state."""
    clock, w = floats(s, STATE.clock), inner(s, STATE.w)
    newton, rates = floats(s, STATE.newton_values), floats(s, STATE.rate_values)
    evaluate_both(
        inner(m, MODEL.dynamics), inner(m, MODEL.constraints), inner(m, MODEL.newton), inner(m, MODEL.rates), w,
        clock[CLOCK.c0_factored], newton, rates,
    )  # fmt: skip
    clock[CLOCK.pivot] = factorise(m, MODEL.newton_lu, newton, floats(s, STATE.newton_work))
    ints(s, STATE.counts)[COUNTS.stale] = 0 if clock[CLOCK.pivot] > SINGULAR_PIVOT else 1
    clock[CLOCK.pivot] = factorise(m, MODEL.rate_lu, rates, floats(s, STATE.rate_work))

"""The large parts of a step, called by address.

numba optimises everything that a function calls as a part of that function, so that a tower of ten functions over the
residual would optimise the residual ten times. Behind an address a part is compiled once; each reads and writes the
packed model m and world s only.
"""

from __future__ import annotations

import numpy as np

from dms_core.assembly.residual import (
    evaluate_both,
    evaluate_constraints,
    evaluate_inputs,
    evaluate_newton,
    evaluate_rates,
    evaluate_residual,
)
from dms_core.compiled.arena import floats, inner, ints
from dms_core.compiled.calls import PART, address, call_part
from dms_core.compiled.jit import compiled
from dms_core.simulation.linear_solve import back_substitute, factorise
from dms_core.simulation.state import BEFORE_JUMP, C0_FACTORED, MODEL, PIVOT, STALE, STATE, T_INPUTS

SINGULAR_PIVOT = 1e-14
"""Pivot, relative to its row, that is rounding: the order of elimination is then chosen anew."""
INPUTS, RESIDUAL, CONSTRAINTS, NEWTON_MATRIX, NEWTON_SOLUTION, RATE_MATRIX, RATE_SOLUTION, BOTH_MATRICES = range(8)


@compiled
def _inputs(m, s):
    """Inputs at clock[T_INPUTS], from the left or the right of a jump."""
    before = ints(s, STATE.counts)[BEFORE_JUMP] == 1
    evaluate_inputs(inner(s, STATE.signals), floats(s, STATE.clock)[T_INPUTS], before, inner(s, STATE.w))


@compiled
def _residual(m, s):
    """The residual at the present iterate."""
    evaluate_residual(inner(m, MODEL.dynamics), inner(m, MODEL.constraints), inner(s, STATE.w))


@compiled
def _constraints(m, s):
    """phi and phi_q v + phi_t at the present iterate."""
    evaluate_constraints(inner(m, MODEL.constraints), inner(s, STATE.w))


@compiled
def _newton_matrix(m, s):
    """Residual, factorised Newton matrix for c0 = clock[C0_FACTORED], and clock[PIVOT], its smallest relative pivot."""
    clock, values, w = floats(s, STATE.clock), floats(s, STATE.newton_values), inner(s, STATE.w)
    dynamics, constraints = inner(m, MODEL.dynamics), inner(m, MODEL.constraints)
    evaluate_newton(dynamics, constraints, inner(m, MODEL.newton), w, clock[C0_FACTORED], values)
    clock[PIVOT] = factorise(m, MODEL.newton_lu, values, floats(s, STATE.newton_work))


@compiled
def _newton_solution(m, s):
    """x from b."""
    values, work = floats(s, STATE.newton_values), floats(s, STATE.newton_work)
    back_substitute(m, MODEL.newton_lu, values, floats(s, STATE.b), floats(s, STATE.x), work)


@compiled
def _rate_matrix(m, s):
    """Residual and factorised matrix of the acceleration problem; clock[PIVOT] as above."""
    values = floats(s, STATE.rate_values)
    dynamics, constraints = inner(m, MODEL.dynamics), inner(m, MODEL.constraints)
    evaluate_rates(dynamics, constraints, inner(m, MODEL.rates), inner(s, STATE.w), values)
    floats(s, STATE.clock)[PIVOT] = factorise(m, MODEL.rate_lu, values, floats(s, STATE.rate_work))


@compiled
def _rate_solution(m, s):
    """rate_x from rate_b."""
    values, work = floats(s, STATE.rate_values), floats(s, STATE.rate_work)
    back_substitute(m, MODEL.rate_lu, values, floats(s, STATE.rate_b), floats(s, STATE.rate_x), work)


@compiled
def _both_matrices(m, s):
    """As _rate_matrix, and the factorised Newton matrix for c0 = clock[C0_FACTORED] of the same state."""
    clock, w = floats(s, STATE.clock), inner(s, STATE.w)
    newton, rates = floats(s, STATE.newton_values), floats(s, STATE.rate_values)
    evaluate_both(
        inner(m, MODEL.dynamics), inner(m, MODEL.constraints), inner(m, MODEL.newton), inner(m, MODEL.rates), w,
        clock[C0_FACTORED], newton, rates,
    )  # fmt: skip
    clock[PIVOT] = factorise(m, MODEL.newton_lu, newton, floats(s, STATE.newton_work))
    ints(s, STATE.counts)[STALE] = 0 if clock[PIVOT] > SINGULAR_PIVOT else 1
    clock[PIVOT] = factorise(m, MODEL.rate_lu, rates, floats(s, STATE.rate_work))


def part_addresses() -> np.ndarray:
    """Addresses of the parts in the order of their numbers, compiled or loaded here."""
    parts = (
        _inputs, _residual, _constraints, _newton_matrix, _newton_solution, _rate_matrix, _rate_solution,
        _both_matrices,
    )  # fmt: skip
    return np.array([address(part, PART) for part in parts], np.int64)


@compiled
def run_part(m, s, part):
    """Run one part."""
    call_part(ints(m, MODEL.parts)[part], m, s)


@compiled
def set_inputs(m, s, t, before):
    """Inputs at t; `before` takes the limit from the left at a jump."""
    floats(s, STATE.clock)[T_INPUTS] = t
    ints(s, STATE.counts)[BEFORE_JUMP] = 1 if before else 0
    run_part(m, s, INPUTS)

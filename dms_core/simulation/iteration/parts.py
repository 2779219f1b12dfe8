"""The large parts of a step, called by address.

numba optimises everything that a function calls as a part of that function, so that a tower of ten functions over the
residual would optimise the residual ten times. Behind an address a part is compiled once. The addresses are those of
the world, `State.parts`; addresses.py fills them in.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import typeof, types
from numba.extending import intrinsic

from dms_core.compiled.arena import fields, floats, ints
from dms_core.compiled.calls import TABLE, call_by_address, call_part
from dms_core.compiled.jit import compiled
from dms_core.simulation.state import CLOCK, COUNTS, STATE, Options

SINGULAR_PIVOT = 1e-14
"""Pivot, relative to its row, that is rounding: the order of elimination is then chosen anew."""


class Parts(NamedTuple):
    """Places in `State.parts`. The first eight, of evaluation.py, read and write m and s only."""

    inputs: int
    residual: int
    constraints: int
    newton_matrix: int
    newton_solution: int
    rate_matrix: int
    rate_solution: int
    both_matrices: int
    solve_stage: int
    """implicit_stage.py"""
    consistent_rates: int
    stage_rates: int
    jump_rates: int
    """initial_rates.py"""
    restart: int
    advance: int
    """step_control.py"""
    radau_matrices: int
    radau_solutions: int
    """radau_matrices.py; these and what follows are 0 where another method runs."""
    radau5_step: int
    """radau5.py"""


PARTS = fields(Parts)

_OPTIONS = typeof(Options(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0))
_RECORD = types.Array(types.float64, 2, "C")
_PAIR = types.UniTuple(types.int64, 2)
STAGE = _PAIR(TABLE, TABLE, _OPTIONS, types.float64, types.float64, types.float64, types.boolean)
RATES = types.boolean(TABLE, TABLE, types.float64)
RESTART = types.boolean(TABLE, TABLE, _OPTIONS)
STEP = types.Tuple((types.int64, types.int64, types.float64))(TABLE, TABLE, _OPTIONS, types.float64)
ADVANCE = _PAIR(TABLE, TABLE, _OPTIONS, types.float64, _RECORD, types.int64)


@intrinsic
def _call_stage(typingctx, address, m, s, o, t, c0, lam_slope, last):  # noqa: ANN001, ANN202
    return call_by_address(STAGE)


@intrinsic
def _call_rates(typingctx, address, m, s, c0):  # noqa: ANN001, ANN202
    return call_by_address(RATES)


@intrinsic
def _call_step(typingctx, address, m, s, o, h):  # noqa: ANN001, ANN202
    return call_by_address(STEP)


@intrinsic
def _call_restart(typingctx, address, m, s, o):  # noqa: ANN001, ANN202
    return call_by_address(RESTART)


@intrinsic
def _call_advance(typingctx, address, m, s, o, t_end, record, recorded):  # noqa: ANN001, ANN202
    return call_by_address(ADVANCE)


@compiled
def run_part(m, s, part):
    """Run one of the parts of evaluation.py."""
    call_part(ints(s, STATE.parts)[part], m, s)


@compiled
def run_stage(m, s, o, t, c0, lam_slope, last):
    """Run `implicit_stage.solve_stage`."""
    return _call_stage(ints(s, STATE.parts)[PARTS.solve_stage], m, s, o, t, c0, lam_slope, last)


@compiled
def run_rates(m, s, part, c0):
    """Run one of the three functions of initial_rates.py that find accelerations and multipliers."""
    return _call_rates(ints(s, STATE.parts)[part], m, s, c0)


@compiled
def run_radau5(m, s, o, h):
    """Run `radau5.radau5_step`."""
    return _call_step(ints(s, STATE.parts)[PARTS.radau5_step], m, s, o, h)


@compiled
def restart(m, s, o):
    """Accelerations and multipliers behind a jump, inputs from the right; False if there are none."""
    return _call_restart(ints(s, STATE.parts)[PARTS.restart], m, s, o)


@compiled
def advance(m, s, o, t_end, record, recorded):
    """Step until t_end; gives (code, number of rows recorded), see step_control.py.

    OUTCOME.buffer_full asks to be called again with room. Nothing is recorded where the record has no rows at all.
    """
    return _call_advance(ints(s, STATE.parts)[PARTS.advance], m, s, o, t_end, record, recorded)


@compiled
def set_inputs(m, s, t, before):
    """Inputs at t; `before` takes the limit from the left at a jump."""
    floats(s, STATE.clock)[CLOCK.t_inputs] = t
    ints(s, STATE.counts)[COUNTS.before_jump] = 1 if before else 0
    run_part(m, s, PARTS.inputs)

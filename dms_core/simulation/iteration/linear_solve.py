"""The two linear systems of a step, solved from the packed tables."""

from dms_core.compiled.arena import fields, indices, inner, ints, naturals, number
from dms_core.compiled.jit import compiled
from dms_core.linear.lu import factor, solve, solve_transposed
from dms_core.linear.symbolic import LuTables

LU = fields(LuTables)


@compiled(makes_arrays=True)
def lu_tables(t):
    """The LuTables behind a packed table."""
    return LuTables(
        number(t, LU.n), number(t, LU.size), number(t, LU.work_size), number(t, LU.updates), number(t, LU.fill),
        number(t, LU.multiply_adds), indices(t, LU.position), naturals(t, LU.row_of), naturals(t, LU.col_of),
        naturals(t, LU.slot), naturals(t, LU.lane), naturals(t, LU.first), naturals(t, LU.diagonal),
        naturals(t, LU.end), naturals(t, LU.group), naturals(t, LU.below), naturals(t, LU.target),
        number(t, LU.lower), number(t, LU.numbers), ints(t, LU.move), naturals(t, LU.place),
    )  # fmt: skip


@compiled
def factorise(model, system, values, work):
    """Factor the linear system in field `system` of the model in place; its smallest relative pivot, 0 if singular."""
    return factor(lu_tables(inner(model, system)), values, work)[0]


@compiled
def back_substitute(model, system, values, b, x, work):
    """x from the factors in `values`."""
    solve(lu_tables(inner(model, system)), values, b, x, work)


@compiled
def back_substitute_transposed(model, system, values, b, x, work):
    """x of the transposed system from the factors in `values`."""
    solve_transposed(lu_tables(inner(model, system)), values, b, x, work)

"""What went wrong where a run stopped, in sentences: a singular position, a wrong derivative, or where it began."""

from __future__ import annotations

import numpy as np

from dms_core.assembly.derivatives.finite import FAR, far_numbers, open_call, sentence
from dms_core.assembly.derivatives.wrong_derivatives import wrong_call
from dms_core.assembly.model import Model
from dms_core.assembly.start import joints_of, quoted
from dms_core.assembly.tables import MODEL, Tables
from dms_core.compiled.arena import Packed, inner
from dms_core.linear.rank import degenerate_rows
from dms_core.results import Result
from dms_core.simulation.state import CLOCK, STATE, State

NEAR_SINGULAR = 1e-2
"""Smallest singular value of the rows, over what it is at the start, from which on a position is called singular."""


def singular_joints(model: Model, q: np.ndarray, t: float) -> tuple[list[str], float, float]:
    """Joints that depend on each other at q though they do not at the start, and both smallest singular values.

    Args:
        model: the model.
        q: position, shape (n_q,).
        t: time [s], for what drives the joints.

    Returns:
        Names of constraints, none where the position is regular; the smallest singular value at q and at the start,
        of rows of length 1.
    """
    rank, start = len(model.start.active), model.start.singular_values
    usual = float(start[min(rank, len(start)) - 1]) if rank and len(start) else 0.0
    if not (usual > 0.0 and np.isfinite(q).all()):
        return [], 0.0, usual
    smallest, part = degenerate_rows(model.jacobian(q, None, t)[2], rank)
    return joints_of(model.layout, part) if smallest < NEAR_SINGULAR * usual else [], smallest, usual


def explain(model: Model, tables: Packed, world: Packed, result: Result, singular: str) -> tuple[Result, str]:
    """The result, told more precisely where that is possible, and sentences on where the last attempt failed.

    Args:
        model: the model.
        tables: what the world was solved with.
        world: the world (a packed State) as the failure left it.
        result: how the run ended.
        singular: what choosing the order anew said last; empty where it was not tried or did succeed.

    Returns:
        The result, and sentences with a space before them; empty where nothing failed.
    """
    if result in (Result.SUCCESS, Result.INTERRUPTED):
        return result, ""
    state: State = world.values
    table, w = tables.table, state.w
    dynamics, constraints = inner(table, MODEL.dynamics), inner(table, MODEL.constraints)
    call = open_call(model.layout, dynamics, constraints, inner(world.table, STATE.w))
    if call is not None:
        return result, f" {sentence(model.layout, call)}"
    if result is not Result.TOO_MANY_STEPS:
        joints, smallest, usual = singular_joints(model, state.q, float(state.clock[CLOCK.t]))
        if joints:
            return Result.SINGULAR_POSITION, (
                f" There the rows of {quoted(joints)} hardly determine the motion any more: their smallest singular "
                f"value is {smallest:.2g}, and was {usual:.2g} at the start."
            )
    if result in (Result.NEWTON_FAILED, Result.STEP_TOO_SMALL):
        wrong = wrong_call(model.layout, dynamics, constraints, Packed(_copy(model, state)))
        if wrong is not None:
            return result, (
                f" The derivatives of {wrong.element.kind} '{wrong.element.name}' contradict its equations: correct "
                "them."
            )
    far = far_numbers(model.system) + _far_inputs(model, w.u)
    if result is Result.MATRIX_SINGULAR and singular:
        return result, f" There {singular}{far}"
    name = widest_coordinate(model, tables.values, state, result is Result.RATES_FAILED)
    kind = model.system.element(name.rpartition(".")[0]).kind
    where = "Steps are held small first by" if result is Result.TOO_MANY_STEPS else "It goes wrong first at"
    return result, f" {where} '{name}' ({kind}).{far}"


def _copy(model: Model, state: State):  # noqa: ANN202
    """Work arrays at the last accepted state, which may be written."""
    w = model.new_work()
    n = model.n_q
    w.q[:n], w.v[:n], w.a[:n], w.lam[:], w.u[:] = state.q, state.v, state.vd, state.lam, state.w.u
    return w


def _far_inputs(model: Model, u: np.ndarray) -> str:
    """The inputs that were set so far from 1 that they may be why a run failed; as `far_numbers`."""
    far = [f"'{n}' = {x}" for n, x in zip(model.layout.input_index, u[:, 0], strict=True) if abs(x) > 10.0**FAR]
    return f" Look at inputs far from 1 in SI units: {', '.join(far)}." if far else ""


def widest_coordinate(model: Model, tables: Tables, state: State, rates: bool) -> str:
    """Name of the coordinate that the last attempt changed most, over its tolerance, or over its size for rates."""
    free = tables.free
    if rates:
        change = np.abs(state.rate_x[: len(free)]) / tables.scale_v[free]
    else:
        change = np.abs(state.w.q[free] - state.q_guess[free]) / state.wq[free]
    change[~np.isfinite(change)] = np.inf
    return model.layout.names[free[int(np.argmax(change))]]

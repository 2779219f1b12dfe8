"""Which element's equations are no numbers: each kernel is called by itself, and what it wrote is looked at."""

from __future__ import annotations

import math

import numpy as np

from dms_core.assembly.layout import Call, Layout
from dms_core.assembly.local import evaluate_constraint, evaluate_dynamic, views
from dms_core.assembly.tables import WORK
from dms_core.compiled.arena import matrix
from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.element import GROUND
from dms_core.validation import numbers_in

NAMED = 3
"""Numbers that a sentence names: those farthest from 1."""


@compiled
def _size(block, m, n):
    """Sum of sizes of block[:m, :n]: not finite where an entry is not."""
    total = 0.0
    for i in range(m):
        for j in range(n):
            total += abs(block[i, j])
    return total


@compiled
def first_open_dynamic(calls, w):
    """First dynamic call whose rows or derivatives are not finite at the state in w; -1 if there is none."""
    x = views(calls, w)
    for e in range(x.kernel.shape[0]):
        n = evaluate_dynamic(x, calls, e, w, 1)
        total = 0.0
        for i in range(n):
            total += abs(x.r_l[i])
        total += _size(matrix(w, WORK.Jq), n, n) + _size(matrix(w, WORK.Jv), n, n) + _size(matrix(w, WORK.Ja), n, n)
        if not total < math.inf:
            return e
    return -1


@compiled
def first_open_constraint(calls, w):
    """First constraint whose rows or derivatives are not finite at the state in w; -1 if there is none."""
    x = views(calls, w)
    for e in range(x.kernel.shape[0]):
        n = evaluate_constraint(x, calls, e, w, 1)
        m = x.row[e + 1] - x.row[e]
        total = _size(x.G, m, n) + _size(x.W, m, n) + _size(matrix(w, WORK.H), n, n)
        for k in range(m):
            total += abs(x.phi_l[k]) + abs(x.phi_t_l[k, 0]) + abs(x.phi_t_l[k, 1])
        if not total < math.inf:
            return e
    return -1


def open_call(layout: Layout, dynamics: np.ndarray, constraints: np.ndarray, w: np.ndarray) -> Call | None:
    """The first call whose equations are not finite at the state in packed work arrays, constraints first."""
    e = first_open_constraint(constraints, w)
    if e >= 0:
        return layout.constraints[e]
    e = first_open_dynamic(dynamics, w)
    return layout.dynamics[e] if e >= 0 else None


def sentence(layout: Layout, call: Call) -> str:
    """Whose equations are not finite, with the most extreme numbers of that element and of the bodies it acts on."""
    element = call.element
    found = []
    for one in (element, *(layout.system.body(b) for b in call.placement.bodies if b != GROUND)):
        whose = "" if one is element else f" of {one.kind} '{one.name}'"  # type: ignore[union-attr]
        found += [(abs(math.log10(abs(x))), f"{key} = {x}{whose}") for key, x in numbers_in(one) if x != 0.0]
    most = [said for _, said in sorted(dict.fromkeys(found), reverse=True)[:NAMED]]
    hint = (
        f" Its numbers farthest from 1: {', '.join(most)}; expected ones with which they stay finite." if most else ""
    )
    return f"{element.kind} '{element.name}': its equations are not finite.{hint}"


def check_finite(layout: Layout, call: Call | None) -> None:
    """Refuse a start at which the equations of this call are not finite.

    Raises:
        ModelError: names the element and its numbers.
    """
    if call is not None:
        raise ModelError(
            sentence(layout, call).replace("not finite.", "not finite at the start.", 1), call.element.name
        )

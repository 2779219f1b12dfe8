"""Which element's equations are no numbers: each kernel is called by itself, and what it wrote is looked at."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator

import numpy as np
from pydantic import BaseModel

from dms_core.assembly.layout import Call, Layout
from dms_core.assembly.local import evaluate_constraint, evaluate_dynamic, views
from dms_core.assembly.tables import WORK
from dms_core.compiled.arena import matrix
from dms_core.compiled.jit import compiled
from dms_core.errors import AssemblyError, ModelError
from dms_core.model.element import GROUND
from dms_core.model.system import System
from dms_core.validation import numbers_in

NAMED = 3
"""Numbers that a sentence names: those farthest from 1."""
ROUNDED = 1e-12
"""Component of a vector, over its largest one, that is a rounded zero: never why equations fail."""
FAR = 9
"""Powers of ten from 1 at which a number is named where equations fail without telling why."""


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


def sentence(layout: Layout, call: Call, when: str = "") -> str:
    """Whose equations are not finite, with the most extreme numbers of that element and of the bodies it acts on.

    Args:
        layout: of the model.
        call: of the element.
        when: words behind "not finite", with a space before them.
    """
    element = call.element
    found = []
    for one in (element, *(layout.system.body(b) for b in call.placement.bodies if b != GROUND)):
        whose = "" if one is element else f" of {one.kind} '{one.name}'"  # type: ignore[union-attr]
        found += [(x, f"{key} = {x}{whose}") for key, x in numbers_in(one) if x != 0.0]
    most = _farthest_from_1(found)
    hint = f" Its numbers farthest from 1: {most}; expected ones with which they stay finite." if most else ""
    return f"{element.kind} '{element.name}': its equations are not finite{when}.{hint}"


def far_numbers(system: System) -> str:
    """The declared numbers that are so far from 1 that they may be why, as a sentence with a space before it."""
    found = [
        (x, f"{key} = {x} of {element.kind} '{element.name}'")
        for element in system.everything()
        for key, x, size in _sized_numbers(element)
        if abs(x) > ROUNDED * size and not 10.0**-FAR < abs(x) < 10.0**FAR
    ]
    most = _farthest_from_1(found)
    return f" Look at numbers far from 1 in SI units: {most}." if most else ""


def _sized_numbers(element: BaseModel) -> Iterator[tuple[str, float, float]]:
    """Every number of a declaration, by its keys, with the largest size in its vector."""
    found = list(numbers_in(element))
    for key, x in found:
        vector = key.rpartition(".")[0]
        yield key, x, max((abs(y) for k, y in found if k.rpartition(".")[0] == vector and vector), default=0.0)


def _farthest_from_1(found: list[tuple[float, str]]) -> str:
    """What is said of the numbers whose sizes are farthest from 1."""
    ranked = sorted({(abs(math.log10(abs(x))), said) for x, said in found}, reverse=True)
    return ", ".join(said for _, said in ranked[:NAMED])


@contextlib.contextmanager
def naming_far_numbers(system: System) -> Iterator[None]:
    """Within, equations that cannot be solved are an error that names the numbers that may be why."""
    try:
        yield
    except np.linalg.LinAlgError as error:
        raise ModelError(f"system '{system.name}': {error}.{far_numbers(system)}") from None
    except (AssemblyError, ModelError) as error:
        error.args = (f"{error}{far_numbers(system)}",)
        raise


def check_finite(layout: Layout, call: Call | None) -> None:
    """Refuse a start at which the equations of this call are not finite.

    Raises:
        ModelError: names the element and its numbers.
    """
    if call is not None:
        raise ModelError(sentence(layout, call, " at the start"), call.element.name)

"""Where every derivative goes: sparsity patterns of the two linear systems and the index maps of the scatter.

Newton matrix of a step, in the scaled unknowns (dq, dv / c0, dlam / c0^2, dmu / c0), c0 = d qdot / d q of the method
(about 1.5 / h), rows r1 / c0, r2 / c0^2, r3, r4 / c0, so that no entry grows as h goes to 0:

         dq                      dv'          dlam'     dmu'
    r1   -1                      1            0         -phi_q^T
    r2   (Jq + H) / c0^2         Ja + Jv/c0   phi_q^T   0
    r3   phi_q                   0            0         0
    r4   W / c0                  phi_q        0         0

The term (phi_q^T mu)_q is left out of r1: mu is zero on every exact solution, so at convergence the matrix is exact.

Acceleration problem at fixed q: unknowns are vdot of second-order coordinates, v of first-order ones, and lam:

    r2       Ja (or Jv)    phi_q^T
    phi_a    phi_q         0
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from dms_core.assembly.layout import Call, Layout


class Part(NamedTuple):
    """Scatter of one local block of every call: values[slot[k]] += block[i[k], j[k]] for ptr[e] <= k < ptr[e + 1]."""

    i: np.ndarray
    j: np.ndarray
    slot: np.ndarray
    ptr: np.ndarray


class NewtonPattern(NamedTuple):
    """Scatter of the Newton matrix."""

    minus: np.ndarray
    plus: np.ndarray
    Jq: Part
    Jv: Part
    Ja: Part
    G_mu: Part
    G_lam: Part
    G_q: Part
    G_v: Part
    W: Part
    H: Part


class RatePattern(NamedTuple):
    """Scatter of the acceleration problem."""

    Jv: Part
    Ja: Part
    G_lam: Part
    G_v: Part


class BlockPattern(NamedTuple):
    """Scatter of each derivative of the residual into a matrix of its own, over all coordinates and rows."""

    Jq: Part
    """Into r2_q, with H."""
    Jv: Part
    Ja: Part
    H: Part
    H_mu: Part
    """Into (phi_q^T mu)_q."""
    G: Part
    W: Part


class Slots:
    """Collects (row, column) pairs of one matrix and numbers them; pairs outside the matrix share one waste slot."""

    def __init__(self) -> None:
        self.number: dict[tuple[int, int], int] = {}

    def add(self, row: int, column: int) -> int:
        """The number of the pair, -1 for the waste slot."""
        if row < 0 or column < 0:
            return -1
        return self.number.setdefault((row, column), len(self.number))

    def coordinates(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns in the order of the numbers."""
        pairs = np.array(list(self.number), np.int32).reshape(-1, 2)
        return np.ascontiguousarray(pairs[:, 0]), np.ascontiguousarray(pairs[:, 1])


def _part(slots: Slots, entries: Iterable[tuple[np.ndarray, Any, Any]], transposed: bool = False) -> Part:
    """Scatter of one block of every call.

    Args:
        slots: numbering of the matrix.
        entries: per call its boolean pattern and the indices in the matrix of the block's rows and of its columns.
        transposed: the block's rows are columns of the matrix.
    """
    i, j, slot, ptr = [], [], [], [0]
    for pattern, rows, columns in entries:
        for k, m in zip(*np.nonzero(pattern), strict=True):
            place = (int(rows[k]), int(columns[m]))
            number = slots.add(*(place[::-1] if transposed else place))
            if number >= 0:
                i.append(k)
                j.append(m)
                slot.append(number)
        ptr.append(len(slot))
    rows_of, columns_of, slots_of = (np.array(x, np.int32) for x in (i, j, slot))
    return Part(rows_of, columns_of, slots_of, np.array(ptr, np.int64))


def _dynamic_blocks(call: Call) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    n = len(call.iq)
    full = np.ones((n, n), bool)
    return tuple(call.placement.pattern) if call.placement.pattern is not None else (full, full, full)


def _constraint_blocks(call: Call) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    n, m = len(call.iq), call.rows
    if call.placement.pattern is not None:
        return tuple(call.placement.pattern)
    return np.ones((m, n), bool), np.ones((m, n), bool), np.ones((n, n), bool)


class _Index:
    """Matrix rows and columns of what is solved for; -1 for ground and welded bodies, their rows, redundant rows."""

    def __init__(self, layout: Layout, free: np.ndarray, solved: np.ndarray) -> None:
        self.of_coordinate = np.full(layout.n_q + 7, -1)
        self.of_coordinate[free] = np.arange(len(free))
        self.of_row = np.full(layout.n_phi, -1)
        self.of_row[solved] = np.arange(len(solved))

    def coordinate(self, call: Call, offset: int) -> np.ndarray:
        k = self.of_coordinate[call.iq]
        return np.where(k >= 0, k + offset, -1)

    def row(self, call: Call, offset: int) -> np.ndarray:
        k = self.of_row[call.row : call.row + call.rows]
        return np.where(k >= 0, k + offset, -1)


def newton_pattern(layout: Layout, free: np.ndarray, solved: np.ndarray) -> tuple[NewtonPattern, Slots]:
    """Scatter of the Newton matrix of size 2 len(free) + 2 len(solved)."""
    n, m = len(free), len(solved)
    slots, at = Slots(), _Index(layout, free, solved)
    minus = np.array([slots.add(k, k) for k in range(n)], np.int32)
    plus = np.array([slots.add(k, n + k) for k in range(n)], np.int32)
    dyn = [
        (*_dynamic_blocks(c), at.coordinate(c, n), at.coordinate(c, 0), at.coordinate(c, n)) for c in layout.dynamics
    ]
    con = [(c, *_constraint_blocks(c)) for c in layout.constraints]
    q = at.coordinate
    return NewtonPattern(
        minus,
        plus,
        Jq=_part(slots, ((b[0], b[3], b[4]) for b in dyn)),
        Jv=_part(slots, ((b[1], b[3], b[5]) for b in dyn)),
        Ja=_part(slots, ((b[2], b[3], b[5]) for b in dyn)),
        G_mu=_part(slots, ((G, at.row(c, 2 * n + m), q(c, 0)) for c, G, W, H in con), transposed=True),
        G_lam=_part(slots, ((G, at.row(c, 2 * n), q(c, n)) for c, G, W, H in con), transposed=True),
        G_q=_part(slots, ((G, at.row(c, 2 * n), q(c, 0)) for c, G, W, H in con)),
        G_v=_part(slots, ((G, at.row(c, 2 * n + m), q(c, n)) for c, G, W, H in con)),
        W=_part(slots, ((W, at.row(c, 2 * n + m), q(c, 0)) for c, G, W, H in con)),
        H=_part(slots, ((H, q(c, n), q(c, 0)) for c, G, W, H in con)),
    ), slots


def block_pattern(layout: Layout) -> tuple[BlockPattern, dict[str, Slots]]:
    """Scatter of the derivatives of the residual, and the entries of each matrix by name: q, v, a, mu, G, W."""
    at = _Index(layout, np.arange(layout.n_q), np.arange(layout.n_phi))
    slots = {name: Slots() for name in ("q", "v", "a", "mu", "G", "W")}
    dyn = [(*_dynamic_blocks(c), at.coordinate(c, 0)) for c in layout.dynamics]
    con = [(*_constraint_blocks(c), at.row(c, 0), at.coordinate(c, 0)) for c in layout.constraints]
    return BlockPattern(
        Jq=_part(slots["q"], ((Jq, k, k) for Jq, Jv, Ja, k in dyn)),
        Jv=_part(slots["v"], ((Jv, k, k) for Jq, Jv, Ja, k in dyn)),
        Ja=_part(slots["a"], ((Ja, k, k) for Jq, Jv, Ja, k in dyn)),
        H=_part(slots["q"], ((H, k, k) for G, W, H, row, k in con)),
        H_mu=_part(slots["mu"], ((H, k, k) for G, W, H, row, k in con)),
        G=_part(slots["G"], ((G, row, k) for G, W, H, row, k in con)),
        W=_part(slots["W"], ((W, row, k) for G, W, H, row, k in con)),
    ), slots


def rate_pattern(layout: Layout, free: np.ndarray, solved: np.ndarray) -> tuple[RatePattern, Slots]:
    """Scatter of the acceleration problem of size len(free) + len(solved)."""
    n = len(free)
    slots, at = Slots(), _Index(layout, free, solved)
    second = np.array([c.differential_rate for c in layout.coordinates] + [True] * 7)
    dyn = []
    for c in layout.dynamics:
        _, Jv, Ja = _dynamic_blocks(c)
        rows, is_second = at.coordinate(c, 0), second[c.iq]
        dyn.append((Jv & ~is_second[None, :], Ja & is_second[None, :], rows))
    con = [(c, _constraint_blocks(c)[0]) for c in layout.constraints]
    return RatePattern(
        Jv=_part(slots, ((b[0], b[2], b[2]) for b in dyn)),
        Ja=_part(slots, ((b[1], b[2], b[2]) for b in dyn)),
        G_lam=_part(slots, ((G, at.row(c, n), at.coordinate(c, 0)) for c, G in con), transposed=True),
        G_v=_part(slots, ((G, at.row(c, n), at.coordinate(c, 0)) for c, G in con)),
    ), slots


def moved(pattern: Any, position: np.ndarray) -> Any:
    """The same scatter into other slots: slot -> position[slot] (where the LU keeps that entry)."""
    parts: list[Any] = []
    for part in pattern:
        if isinstance(part, Part):
            parts.append(part._replace(slot=np.ascontiguousarray(position[part.slot].astype(np.int32))))
        else:
            parts.append(np.ascontiguousarray(position[part].astype(np.int32)))
    return type(pattern)(*parts)

"""Sensors and starts of a run: derivatives at one recorded state, with what belongs to it by the equations.

A sensor y = h(q, v, vdot, lam, u) reads accelerations, first-order rates and multipliers that the equations give where
q and v are known (linearise.py); at a state of the run they are eliminated,

    dy = y_q dq + y_v dv + y_a da + y_lam dlam + y_u du + y_p dp,      (da, dlam) by (dq, dv, du, dp)

in independent coordinates: the tangents of a run lie in those of the constraints. A declared number moves phi, so that
dq has a part of its own there; of that part nothing is left in the states that are chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dms_core.analyses.independent import Independent, independent
from dms_core.analyses.linearise import displacements, rates_of
from dms_core.assembly.derivatives.blocks import Blocks, OperatingPoint, SensorBlocks
from dms_core.assembly.derivatives.parameter_derivatives import Direction, ParameterBlocks
from dms_core.assembly.model import Model
from dms_core.assembly.residual import dense_constraints
from dms_core.compiled.arena import Packed
from dms_core.errors import InputError


class Number(NamedTuple):
    """A declared number, by the name of its element and its keys, as 'mass' or 'path.1.point.0'."""

    element: str
    path: str

    @property
    def name(self) -> str:
        """Both in one."""
        return f"{self.element}.{self.path}"


class Node(NamedTuple):
    """Sensors at one state by states, inputs and declared numbers."""

    y: np.ndarray
    """Shape (n_y,)."""
    by_q: np.ndarray
    """Shape (n_y, n_q)."""
    by_v: np.ndarray
    by_u: np.ndarray
    """By values of inputs, shape (n_y, n_u)."""
    by_p: np.ndarray
    """Shape (n_y, n_p)."""


def _with_numbers(b: Blocks, numbers: Sequence[ParameterBlocks]) -> Blocks:
    """The same blocks with each declared number as one more input, of which the value counts alone."""
    if not numbers:
        return b

    def wider(block: np.ndarray, name: str) -> np.ndarray:
        more = np.zeros((len(block), len(numbers), 3))
        more[:, :, 0] = np.column_stack([getattr(p, name) for p in numbers])
        return np.concatenate([block, more], axis=1)

    return b._replace(r2_u=wider(b.r2_u, "r2"), r3_u=wider(b.r3_u, "r3"), r4_u=wider(b.r4_u, "r4"))


def by_numbers(model: Model, numbers: Sequence[Number], point: OperatingPoint) -> list[ParameterBlocks]:
    """Residual and sensors by each number at a point."""
    return [model.parameter_derivatives.of(*number, point) for number in numbers]


def acceleration_rows(model: Model, direction: Direction, point: OperatingPoint) -> np.ndarray:
    """phi_q vdot + (phi_q v)_q v + phi_tt by a declared number at fixed q, v, vdot: shape (n_phi,)."""
    if not direction.constraints.any():
        return np.zeros(model.n_phi)
    work, calls, n = model.new_work(), model.sensing.values.constraints.values, model.n_q
    work.q[:n], work.v[:n], work.u[:] = point.q, point.v, point.u
    packed, ends = Packed(work), []
    for sign in (1.0, -1.0):
        G, W = np.zeros((model.n_phi, n + 7)), np.zeros((model.n_phi, n + 7))
        moved = Packed(calls._replace(par=calls.par + sign * direction.constraints))
        dense_constraints(moved.table, packed.table, G, W)
        ends.append(G[:, :n] @ point.a + W[:, :n] @ point.v)
    return (ends[0] - ends[1]) / (2.0 * direction.step)


def start_columns(
    model: Model, point: OperatingPoint, numbers: Sequence[Number]
) -> tuple[Independent, np.ndarray, np.ndarray]:
    """(chart, dq, dv) of independent states, then of declared numbers while those states stay: shapes (columns, n_q).

    Raises:
        InputError: a number moves a body that is welded to the ground, which no step moves.
    """
    b = _with_numbers(model.derivatives.blocks(point), by_numbers(model, numbers, point))
    at = independent(model, b.phi_q.toarray())
    n_x, n_u = 2 * len(at.chosen) + len(at.first), len(model.layout.input_index)
    dq, dv = displacements(model, b, at, n_x, n_u + len(numbers))
    wanted = [*range(n_x), *range(n_x + n_u, n_x + n_u + len(numbers))]
    dq, dv = dq[:, wanted].T.copy(), dv[:, wanted].T.copy()
    held = np.setdiff1d(at.second, model.tables.values.free)
    for number, moved in zip(numbers, dq[n_x:], strict=True):
        if len(held) and np.abs(moved[held]).max() > 1e-12:
            k = held[int(np.argmax(np.abs(moved[held])))]
            raise InputError(
                f"'{number.name}' moves '{model.layout.names[k]}', a coordinate of a body that is welded to the "
                "ground, which a run takes for fixed. Expected a number that moves no welded body."
            )
    return at, dq, dv


def _reads_rates(s: SensorBlocks, rows: np.ndarray, first: np.ndarray) -> bool:
    """Whether any of these sensors reads an acceleration, a multiplier or a first-order rate."""
    return bool(s.a[rows].any() or s.lam[rows].any() or s.v[np.ix_(rows, first)].any())


def node(
    model: Model, point: OperatingPoint, rows: np.ndarray, numbers: Sequence[Number], directions: Sequence[Direction]
) -> Node:
    """These rows of the sensors at a point whose accelerations and multipliers belong to it."""
    s = model.derivatives.sensor_blocks(point)
    first = np.flatnonzero(~model.second_order)
    known = by_numbers(model, numbers, point)
    y_p = np.column_stack([np.zeros((len(rows), 0)), *(p.y[rows] for p in known)])
    if not _reads_rates(s, rows, first):
        return Node(s.y[rows], s.q[rows], s.v[rows], s.u[rows, :, 0], y_p)
    b = _with_numbers(model.derivatives.blocks(point), known)
    at = independent(model, b.phi_q.toarray())
    n_z, n_u, n_p = len(at.chosen), len(model.layout.input_index), len(numbers)
    n_x, every = 2 * n_z + len(at.first), n_u + n_p
    dq, dv = displacements(model, b, at, n_x, every)
    bend = np.zeros((model.n_phi, n_x + 3 * every))
    for k, direction in enumerate(directions):
        bend[:, n_x + n_u + k] = acceleration_rows(model, direction, point)
    rates = rates_of(model, point, b, at, dq, dv, bend)
    dy = s.q[rows] @ dq + s.v[rows] @ rates.v + s.a[rows] @ rates.a + s.lam[rows] @ rates.lam
    by_q, by_v = np.zeros((len(rows), model.n_q)), np.zeros((len(rows), model.n_q))
    by_q[:, at.chosen], by_v[:, at.chosen], by_q[:, at.first] = np.split(dy[:, :n_x], [n_z, 2 * n_z], axis=1)
    return Node(s.y[rows], by_q, by_v, s.u[rows, :, 0] + dy[:, n_x : n_x + n_u], y_p + dy[:, n_x + n_u : n_x + every])

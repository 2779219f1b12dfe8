"""Independent coordinates at a position: which coordinates tell all others, and how the others follow from them.

    z = q[chosen],    phi_q N = 0,   N[chosen] = 1        dq = N dz + L(-dphi)

Coordinates of second order (bodies, controllers) may be bound by constraints. Those of first order (fibre lengths,
activations) are states of their own; a constraint that reads one is refused.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.linear.null_space import null_space
from dms_core.linear.rank import independent_rows


class Independent(NamedTuple):
    """Independent coordinates of second order at one position."""

    second: np.ndarray
    """Coordinates of second order, shape (n_s,)."""
    first: np.ndarray
    """Coordinates of first order, shape (n_f,)."""
    rows: np.ndarray
    """Independent constraint rows there."""
    chosen: np.ndarray
    """Coordinates of second order that tell the others, shape (n_z,)."""
    N: np.ndarray
    """Motions of unit rate of each of them, shape (n_q, n_z): phi_q N = 0 and N[chosen] = 1."""
    L: np.ndarray
    """Lift of constraint rates, shape (n_q, rows): phi_q L = 1 and L[chosen] = 0."""


def orders(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of second and of first order.

    Raises:
        ModelError: a constraint reads a coordinate of first order; names both.
    """
    second, first = np.flatnonzero(model.second_order), np.flatnonzero(~model.second_order)
    bound = set(first.tolist())
    for call in model.layout.constraints:
        for k in call.iq:
            if int(k) in bound:
                raise ModelError(
                    f"{call.element.kind} '{call.element.name}' reads '{model.layout.names[k]}', a state of first "
                    "order. Expected constraints between bodies and other coordinates of second order only.",
                    call.element.name,
                )
    return second, first


def basis(model: Model, G: np.ndarray) -> np.ndarray:
    """Motions that constraints allow, first-order states included, orthonormal: shape (n_q, freedoms).

    Args:
        model: a compiled model.
        G: phi_q, shape (n_phi, n_q).
    """
    second, first = orders(model)
    moving = null_space(G[:, second])
    N = np.zeros((model.n_q, moving.shape[1] + len(first)))
    N[second, : moving.shape[1]] = moving
    N[first, moving.shape[1] + np.arange(len(first))] = 1.0
    return N


def independent(model: Model, G: np.ndarray) -> Independent:
    """Independent coordinates where phi_q is G, shape (n_phi, n_q).

    Of all sets of coordinates the one is taken whose motions are told apart best (QR with column pivoting).
    """
    second, first = orders(model)
    inner = G[:, second]
    rows = independent_rows(inner).independent if model.n_phi else np.zeros(0, int)
    moving = null_space(inner)
    n_z = moving.shape[1]
    pivots = la.qr(moving.T, mode="r", pivoting=True)[1][:n_z] if n_z else np.zeros(0, int)
    return _with_basis(model, G, second, first, rows, second[np.sort(pivots)])


def with_chosen(model: Model, G: np.ndarray, chosen: np.ndarray, rows: np.ndarray | None = None) -> Independent:
    """The same, of given independent coordinates, and constraint rows where they are given.

    Raises:
        numpy.linalg.LinAlgError: they do not tell the others there.
    """
    second, first = orders(model)
    if rows is None:
        rows = independent_rows(G[:, second]).independent if model.n_phi else np.zeros(0, int)
    return _with_basis(model, G, second, first, rows, chosen)


def _with_basis(
    model: Model, G: np.ndarray, second: np.ndarray, first: np.ndarray, rows: np.ndarray, chosen: np.ndarray
) -> Independent:
    """N and L of chosen coordinates."""
    pick = (second[None, :] == chosen[:, None]).astype(float)
    inverse = np.linalg.inv(np.vstack([G[rows][:, second], pick]))
    N, L = np.zeros((model.n_q, len(chosen))), np.zeros((model.n_q, len(rows)))
    L[second], N[second] = inverse[:, : len(rows)], inverse[:, len(rows) :]
    return Independent(second, first, rows, chosen, N, L)


def state_names(model: Model, chosen: np.ndarray, first: np.ndarray) -> tuple[str, ...]:
    """'q.<coordinate>', 'v.<coordinate>' of independent coordinates, then 'q.<state>' of first-order states."""
    names = model.layout.names
    return (*(f"q.{names[k]}" for k in chosen), *(f"v.{names[k]}" for k in chosen), *(f"q.{names[k]}" for k in first))

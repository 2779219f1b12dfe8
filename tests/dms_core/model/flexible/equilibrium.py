"""Static equilibrium and free vibration from the residual's own derivatives: small, dense where it may be."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from dms_core.assembly.derivatives.blocks import OperatingPoint
from dms_core.assembly.model import Model


def at_rest(model: Model, q: np.ndarray | None = None, **inputs: float) -> OperatingPoint:
    """The model at rest at q (its start by default), under inputs of these values and multipliers 0."""
    n, m = model.n_q, model.n_phi
    u = np.zeros((len(model.layout.input_index), 3))
    for name, value in inputs.items():
        u[model.layout.input_index[name], 0] = value
    zero = np.zeros(n)
    return OperatingPoint(model.start.q if q is None else q, zero, zero, zero, np.zeros(m), np.zeros(m), u)


def equilibrium(model: Model, share: float = 1.0, **inputs: float) -> OperatingPoint:
    """phi_q^T lam = f(q, 0, u), phi = 0 by Newton's method, the inputs brought up from 0 in steps.

    Args:
        model: what is to rest.
        share: of the inputs, the first step; it is halved where Newton's method fails and doubled where it does not.
        inputs: their final values.

    Raises:
        AssertionError: no convergence with steps of a thousandth.
    """
    at, done = at_rest(model), 0.0
    while done < 1.0:
        aim = min(done + share, 1.0)
        try:
            found = _newton(model, at._replace(u=at_rest(model, **{k: x * aim for k, x in inputs.items()}).u))
        except (FloatingPointError, RuntimeError):
            share *= 0.5
            assert share > 1e-3, f"no equilibrium beyond {done:.3g} of the inputs"
            continue
        at, done, share = found, aim, 2.0 * share
    return at


def _newton(model: Model, at: OperatingPoint) -> OperatingPoint:
    """Newton's method to the last digits.

    Raises:
        FloatingPointError: it does not converge.
    """
    rows, before = model.start.active, np.inf
    for _ in range(25):
        b = model.derivatives.blocks(at)
        G = b.phi_q[rows]
        matrix = sp.block_array([[b.r2_q, G.T], [G, None]], format="csc")
        change = spsolve(matrix, -np.concatenate([b.r2, b.r3[rows]]))
        lam = at.lam.copy()
        lam[rows] += change[model.n_q :]
        at = at._replace(q=at.q + change[: model.n_q], lam=lam)
        size = np.abs(change[: model.n_q]).max()
        if not size < 1.0:
            break
        if size < 1e-11 or (size < 1e-8 and size >= before):
            return at
        before = size
    raise FloatingPointError


def frequencies(model: Model, at: OperatingPoint, count: int) -> np.ndarray:
    """The lowest natural frequencies about an equilibrium [rad/s], shape (count,)."""
    return modes(model, at, count)[0]


def modes(model: Model, at: OperatingPoint, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The lowest natural frequencies [rad/s] and their modes as columns of q, shapes (count,) and (n_q, count)."""
    b = model.derivatives.blocks(at)
    N = la.null_space(b.phi_q[model.start.active].toarray())
    K, M = (N.T @ (x @ N) for x in (b.r2_q, b.r2_a))
    squares, shapes = la.eigh(0.5 * (K + K.T), 0.5 * (M + M.T), subset_by_index=(0, count - 1))
    return np.sqrt(np.maximum(squares, 0.0)), N @ shapes


def place(model: Model, q: np.ndarray, body: str) -> np.ndarray:
    """Position of a body [m], shape (3,)."""
    o = model.layout.offset[body]
    return q[o : o + 3]

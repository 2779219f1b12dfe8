"""A consistent start: q on phi = 0, v on phi_q v + phi_t = 0, states in equilibrium, independent rows."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dms_core.assembly.layout import GROUND_COORDINATES
from dms_core.assembly.residual import evaluate_inputs
from dms_core.compiled.arena import Packed
from dms_core.errors import AssemblyError
from dms_core.linear.rank import independent_rows
from dms_core.model.constraints.fixed import Fixed
from dms_core.model.constraints.revolute import Revolute
from dms_core.model.constraints.slider import Slider
from dms_core.model.geometry.rotations import rotated

if TYPE_CHECKING:
    from dms_core.assembly.model import Model

MAX_ITERATIONS = 60
TOLERANCE = 1e-13
"""Positions are assembled to rounding, so that a run does not start with a constraint error."""
ACCEPTED = 1e-10
"""Constraint error at which a stalled assembly still counts as closed."""
VELOCITY_TOLERANCE = 1e-6
"""Relative violation up to which declared velocities are taken as rounded and projected."""


class Start(NamedTuple):
    """The assembled start."""

    q: np.ndarray
    v: np.ndarray
    active: np.ndarray
    """Independent constraint rows."""
    redundant: np.ndarray
    """Rows that the others imply."""
    singular_values: np.ndarray
    """Of phi_q at the start, largest first."""
    moved: float
    """Largest change of a declared coordinate by closing the constraints; states that elements set do not count."""


def assemble(model: Model, known: Start | None = None) -> Start:
    """Bring the declared start onto the constraints.

    Args:
        model: laid out, not yet ordered.
        known: start of a model of the same structure, whose independent rows are taken over.

    Raises:
        AssemblyError: a loop cannot close (constraint and gap are named), or declared velocities contradict a joint;
            the latter is not looked for in what a driver moves at the start.
    """
    q, v = (x[: model.n_q].copy() for x in model.layout.start())
    declared = q.copy()
    q = _closed(model, q, model.layout.system.name)
    _check_turns(model, q)
    moved = float(np.max(np.abs(q - declared)))
    active, redundant, singular_values = _rows(model, q) if known is None else known[2:5]
    v = _velocities(model, q, v)
    _start_states(model, q, v)
    return Start(q, v, active, redundant, singular_values, moved)


def _closed(model: Model, q: np.ndarray, name: str) -> np.ndarray:
    """Positions on phi = 0: Newton steps of least norm, shortened while |phi| does not fall."""
    phi, _, G, _ = model.constraint_jacobian(q)
    size = np.abs(phi).max(initial=0.0)
    for _ in range(MAX_ITERATIONS):
        if size < TOLERANCE:
            break
        step = np.linalg.lstsq(G, phi, rcond=1e-10)[0]
        for shorter in 0.5 ** np.arange(8):
            trial = q - shorter * step
            phi_t, _, G_t, _ = model.constraint_jacobian(trial)
            if np.abs(phi_t).max() < size:
                break
        else:
            break
        q, phi, G, size = trial, phi_t, G_t, np.abs(phi_t).max()
    if size > ACCEPTED:
        row, gap = _widest_gap(model, q)
        raise AssemblyError(
            f"system '{name}' cannot be assembled: constraint '{row}' stays open by {gap:.3g} (m or -) "
            "after least-squares assembly. Check the lengths of that loop, or declare start poses nearer to the "
            "closed one."
        )
    return q


def _check_turns(model: Model, q: np.ndarray) -> None:
    """Perpendicular directions stay so in a body that is turned over: a joint closed like that is an error."""
    whole = np.concatenate([q, GROUND_COORDINATES])
    for call in model.layout.constraints:
        if not isinstance(call.element, Fixed | Slider | Revolute):
            continue
        local = whole[call.iq]
        for a, b in zip(*call.element.aligned(call.placement.numbers), strict=True):
            if np.dot(rotated(local, 0, tuple(a)), rotated(local, 7, tuple(b))) < 0.0:
                raise AssemblyError(
                    f"{call.element.kind} '{call.element.name}' can be assembled only with '{call.element.body_j}' "
                    "turned over by half a turn; declare its start orientation nearer to that of the joint, or reverse "
                    "the direction that the joint has in it."
                )


def _widest_gap(model: Model, q: np.ndarray) -> tuple[str, float]:
    """Constraint row that is open most, and by how much, with every body whole again: least squares stretches them."""
    q = q.copy()
    for body in model.system.bodies:
        if body.rigid:
            p = q[model.layout.offset[body.name] + 3 :][:4]
            p /= np.linalg.norm(p)
    phi = np.abs(model.constraint_jacobian(q)[0])
    row = int(np.argmax(phi))
    return model.layout.row_names[row], float(phi[row])


def _rows(model: Model, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Independent and redundant rows of phi_q; a row counts as redundant only if it is so in a second position too."""
    if model.n_phi == 0:
        none = np.zeros(0, int)
        return none, none, np.zeros(0)
    G = model.constraint_jacobian(q)[2]
    active, redundant, singular_values, _ = independent_rows(G)
    if len(redundant) == 0:
        return active, redundant, singular_values
    freedom = np.random.default_rng(0).normal(size=model.n_q)
    freedom -= np.linalg.lstsq(G, G @ freedom, rcond=1e-10)[0]
    if np.linalg.norm(freedom) > 1e-9:
        try:
            near = _closed(model, q + 1e-2 * freedom / np.linalg.norm(freedom), "near the start")
        except AssemblyError:
            return active, redundant, singular_values
        other = independent_rows(model.constraint_jacobian(near)[2])
        if len(other[0]) > len(active):
            active, redundant = other[:2]
    return active, redundant, singular_values


def _velocities(model: Model, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Velocities on phi_q v + phi_t = 0.

    A contradiction of declared ones is an error; in a mechanism that a driver moves they are a guess, and the nearest
    are taken.
    """
    _, phi_v, G, _ = model.constraint_jacobian(q, v)
    _, phi_t, _, _ = model.constraint_jacobian(q, np.zeros_like(v))
    correction = np.linalg.lstsq(G, phi_v, rcond=1e-10)[0] if model.n_phi else np.zeros_like(v)
    size = np.abs(v).max(initial=0.0)
    driven = _driven(G, phi_t)
    gap = np.where(driven, 0.0, np.abs(phi_v))
    if size > 0.0 and gap.max(initial=0.0) > VELOCITY_TOLERANCE * size:
        row = int(np.argmax(gap))
        worst = int(np.argmax(np.abs(correction) * np.any(G[~driven] != 0.0, axis=0)))
        raise AssemblyError(
            f"the declared velocities are inconsistent: constraint '{model.layout.row_names[row]}' would open at "
            f"{phi_v[row]:.4g} (m/s or 1/s). The nearest consistent velocity changes '{model.layout.names[worst]}' "
            f"from {v[worst]:.6g} to {v[worst] - correction[worst]:.6g}; declare all velocities of that loop."
        )
    return v - correction


def _driven(G: np.ndarray, phi_t: np.ndarray) -> np.ndarray:
    """True for the rows of a mechanism, coordinates that constraints link, in which a driver moves; shape (m,)."""
    touches, rows = G != 0.0, phi_t != 0.0
    while True:
        more = np.any(touches[:, np.any(touches[rows], axis=0)], axis=1) | rows
        if np.array_equal(more, rows):
            return rows
        rows = more


def _start_states(model: Model, q: np.ndarray, v: np.ndarray) -> None:
    """Let elements set their own coordinates from the assembled positions (fibres in equilibrium, PID states)."""
    w = model.new_work()
    signals, packed = Packed(model._signals), Packed(w)
    evaluate_inputs(signals.table, 0.0, False, packed.table)
    w.q[: model.n_q], w.v[: model.n_q] = q, v
    for call in model.layout.dynamics:
        hook = getattr(call.element, "start_states", None)
        if hook is None:
            continue
        own = model.layout.offset[call.element.name]
        for k, (value, rate) in enumerate(hook(model.layout.system, w.q[call.iq], w.u[call.iu])):
            q[own + k], v[own + k] = value, rate
            w.q[own + k], w.v[own + k] = value, rate

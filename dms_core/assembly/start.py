"""A consistent start: q on phi = 0, v on phi_q v + phi_t = 0, states in equilibrium, independent rows."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from dms_core.assembly.layout import GROUND_COORDINATES, Layout
from dms_core.assembly.residual import evaluate_inputs
from dms_core.assembly.tables import Signals, new_work
from dms_core.compiled.arena import Packed
from dms_core.errors import AssemblyError, ModelWarning, counted
from dms_core.linear.rank import degenerate_rows, independent_rows, least_norm
from dms_core.model.constraints.euler_norm import EulerNorm
from dms_core.model.element import Constraint
from dms_core.model.geometry.rotations import rotated

Jacobian = Callable[..., tuple[np.ndarray, ...]]
"""(q, v=0, t=0) -> (phi, phi_q v + phi_t, phi_q, (phi_q v)_q), shapes (n_phi,), (n_phi,), (n_phi, n_q) twice."""

MAX_ITERATIONS = 60
TOLERANCE = 1e-13
"""Positions are assembled to rounding, so that a run does not start with a constraint error."""
ACCEPTED = 1e-10
"""Constraint error at which a stalled assembly still counts as closed."""
FAR = 0.02
"""Distance from its declared start beyond which the way of a body is worth a warning [m]: poses that are rounded to a
centimetre stay below it, and one that is read off a wrong point, axis or unit is beyond it in mechanisms of the size of
an arm."""
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
    """Singular values of phi_q at the start, largest first."""
    moved: float
    """Largest change of a declared coordinate by closing the constraints; states that elements set do not count."""


def assemble(layout: Layout, signals: Signals, jacobian: Jacobian, known: Start | None = None) -> Start:
    """Bring the declared start onto the constraints.

    Args:
        layout: the system, laid out.
        signals: its inputs.
        jacobian: its constraints with their derivatives.
        known: start of a system of the same structure, whose independent rows are taken over.

    Raises:
        AssemblyError: a loop cannot close (constraint and gap are named), the start is a singular position, or declared
            velocities contradict a joint; the latter is not looked for in what a driver moves at the start.
    """
    q, v = (x[: layout.n_q].copy() for x in layout.start())
    declared = q.copy()
    q = _closed(layout, jacobian, q, layout.system.name)
    _check_turns(layout, q)
    moved = float(np.max(np.abs(q - declared)))
    active, redundant, singular_values = _rows(layout, jacobian, q) if known is None else known[2:5]
    G = jacobian(q)[2]
    _warn_of_moved_bodies(layout, declared, q, G)
    if known is None:
        _warn_of_drivers(layout, G, len(active))
    v = _velocities(layout, jacobian, q, v)
    _start_states(layout, signals, q, v)
    return Start(q, v, active, redundant, singular_values, moved)


def _closed(layout: Layout, jacobian: Jacobian, q: np.ndarray, name: str) -> np.ndarray:
    """Positions on phi = 0: Newton steps of least norm, shortened while |phi| does not fall."""
    phi, _, G, _ = jacobian(q)
    size = np.abs(phi).max(initial=0.0)
    for _ in range(MAX_ITERATIONS):
        if size < TOLERANCE:
            break
        step = least_norm(G, phi)
        for shorter in 0.5 ** np.arange(8):
            trial = q - shorter * step
            phi_t, _, G_t, _ = jacobian(trial)
            if np.abs(phi_t).max() < size:
                break
        else:
            break
        q, phi, G, size = trial, phi_t, G_t, np.abs(phi_t).max()
    if not size <= ACCEPTED:
        row, gap = _widest_gap(layout, jacobian, q)
        open_drivers = _driver_rows(layout) & (np.abs(phi) > 0.1 * size)
        if np.count_nonzero(open_drivers) > 1:
            raise AssemblyError(
                f"system '{name}' cannot be assembled: the drivers {_drivers_of(layout, open_drivers)} contradict each "
                f"other; their inputs at t = 0 leave '{row}' open by {gap:.3g} (m or rad). Remove one, or give them "
                "inputs that agree."
            )
        raise AssemblyError(
            f"system '{name}' cannot be assembled: constraint '{row}' stays open by {gap:.3g} (m or -) "
            f"after least-squares assembly. Check the lengths and axes of that loop, which are those of "
            f"{_loop_of(layout, G, row)}, or declare start poses nearer to the closed one."
        )
    return q


def _loop_of(layout: Layout, G: np.ndarray, row: str) -> str:
    """Names of the joints that are linked with a row."""
    linked = _linked(G, np.array([name == row for name in layout.row_names])).astype(float)
    return quoted(joints_of(layout, linked))


def _warn_of_moved_bodies(layout: Layout, declared: np.ndarray, q: np.ndarray, G: np.ndarray) -> None:
    """Warns of the body that assembly moved farthest from where it was declared, if that is far.

    Where a driver moves a mechanism its declared start is a guess, and nothing is said.
    """
    linked, far = abs(G[_linked(G, _driver_rows(layout))]).sum(axis=0) > 0.0, []
    for body in layout.system.bodies:
        k = layout.offset[body.name]
        if not linked[k : k + len(body.coordinates())].any():
            far.append((float(np.linalg.norm(q[k : k + 3] - declared[k : k + 3])), body.name))
    distance, name = max(far, default=(0.0, ""))
    if distance > FAR:
        warnings.warn(
            f"system '{layout.system.name}': closing the joints moved the body '{name}' by {distance:.3g} m from its "
            "declared start. Compare its position and orientation with the points and axes of its joints.",
            ModelWarning,
            stacklevel=4,
        )


def _driver_rows(layout: Layout) -> np.ndarray:
    """True for the rows of constraints that read an input; shape (n_phi,)."""
    rows = np.zeros(layout.n_phi, bool)
    for call in layout.constraints:
        rows[call.row : call.row + call.rows] = len(call.iu) > 0
    return rows


def _drivers_of(layout: Layout, rows: np.ndarray) -> str:
    """Names of the constraints that read an input and own one of these rows."""
    calls = [c for c in layout.constraints if len(c.iu) and rows[c.row : c.row + c.rows].any()]
    return ", ".join(f"'{c.element.name}'" for c in calls)


def _warn_of_drivers(layout: Layout, G: np.ndarray, rank: int) -> None:
    """Warns of drivers that determine more than the joints leave free, though their inputs agree at the start."""
    drivers = _driver_rows(layout)
    if not drivers.any() or rank == layout.n_phi:
        return
    others = len(independent_rows(G[~drivers]).independent) if not drivers.all() else 0
    if rank - others < np.count_nonzero(drivers):
        warnings.warn(
            f"system '{layout.system.name}': {_drivers_of(layout, drivers)} drive more than the joints leave free. The "
            "equations can hold only as long as the inputs agree; a run stops where they do not. Remove a driver.",
            ModelWarning,
            stacklevel=4,
        )


def _check_turns(layout: Layout, q: np.ndarray) -> None:
    """Perpendicular directions stay so in a body that is turned over: a joint closed like that is an error."""
    whole = np.concatenate([q, GROUND_COORDINATES])
    for call in layout.constraints:
        assert isinstance(call.element, Constraint)
        local = whole[call.iq]
        for a, b in zip(*call.element.aligned(call.placement.numbers), strict=True):
            if np.dot(rotated(local, 0, tuple(a)), rotated(local, 7, tuple(b))) < 0.0:
                turned = call.placement.bodies[1]
                raise AssemblyError(
                    f"{call.element.kind} '{call.element.name}' can be assembled only with '{turned}' "
                    "turned over by half a turn; declare its start orientation nearer to that of the joint, or reverse "
                    "the direction that the joint has in it."
                )


def _widest_gap(layout: Layout, jacobian: Jacobian, q: np.ndarray) -> tuple[str, float]:
    """Constraint row that is open most, and by how much, with every body whole again: least squares stretches them."""
    q = q.copy()
    for body in layout.system.bodies:
        if body.rigid:
            p = q[layout.offset[body.name] + 3 :][:4]
            p /= np.linalg.norm(p)
    phi = np.abs(jacobian(q)[0])
    row = int(np.argmax(phi))
    return layout.row_names[row], float(phi[row])


def _rows(layout: Layout, jacobian: Jacobian, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Independent and redundant rows of phi_q; a row counts as redundant only if it is so in a second position too."""
    if layout.n_phi == 0:
        none = np.zeros(0, int)
        return none, none, np.zeros(0)
    G = jacobian(q)[2]
    active, redundant, singular_values, _ = independent_rows(G)
    if len(redundant) == 0:
        return active, redundant, singular_values
    freedom = np.random.default_rng(0).normal(size=layout.n_q)
    freedom -= least_norm(G, G @ freedom)
    if np.linalg.norm(freedom) > 1e-9:
        try:
            near = _closed(layout, jacobian, q + 1e-2 * freedom / np.linalg.norm(freedom), "near the start")
        except AssemblyError:
            return active, redundant, singular_values
        other = independent_rows(jacobian(near)[2])
        if len(other[0]) > len(active):
            raise _singular_start(layout, G, len(other[0]), len(active))
    return active, redundant, singular_values


def _singular_start(layout: Layout, G: np.ndarray, rank: int, here: int) -> AssemblyError:
    """Rows lose rank at the start, from `rank` to `here`: several ways lead on, and nothing tells which is right."""
    joints = quoted(joints_of(layout, degenerate_rows(G, rank)[1]))
    return AssemblyError(
        f"system '{layout.system.name}' starts in a singular position: there {joints} leave "
        f"{counted(rank - here, 'freedom')} more than nearby, and which way the mechanism goes on is not determined. "
        "Declare start poses a little off it, on the branch that is meant."
    )


def joints_of(layout: Layout, part: np.ndarray) -> list[str]:
    """Names of the joints whose rows have a large part in something, part of shape (n_phi,); the largest first."""
    joints = [c for c in layout.constraints if not isinstance(c.element, EulerNorm)]
    parts = [(part[c.row : c.row + c.rows].max(initial=0.0), c.element.name) for c in joints]
    ranked = sorted(parts, key=lambda x: -x[0])
    return [name for size, name in ranked if size > ranked[0][0] / 3.0]


def quoted(names: list[str]) -> str:
    """The first few of the names."""
    more = f" and {len(names) - 6} more joints" if len(names) > 6 else ""
    return ", ".join(f"'{name}'" for name in names[:6]) + more


def _velocities(layout: Layout, jacobian: Jacobian, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Velocities on phi_q v + phi_t = 0.

    A contradiction of declared ones is an error; in a mechanism that a driver moves they are a guess, and the nearest
    are taken.
    """
    _, phi_v, G, _ = jacobian(q, v)
    _, phi_t, _, _ = jacobian(q, np.zeros_like(v))
    correction = least_norm(G, phi_v)
    size = np.abs(v).max(initial=0.0)
    driven = _linked(G, phi_t != 0.0)
    gap = np.where(driven, 0.0, np.abs(phi_v))
    if size > 0.0 and gap.max(initial=0.0) > VELOCITY_TOLERANCE * size:
        row = int(np.argmax(gap))
        worst = int(np.argmax(np.abs(correction) * (abs(G[~driven]).sum(axis=0) > 0.0)))
        raise AssemblyError(
            f"the declared velocities are inconsistent: constraint '{layout.row_names[row]}' would open at "
            f"{phi_v[row]:.4g} (m/s or 1/s). The nearest consistent velocity changes '{layout.names[worst]}' "
            f"from {v[worst]:.6g} to {v[worst] - correction[worst]:.6g}; declare all velocities of that loop."
        )
    return v - correction


def _linked(G: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """True for all rows of the mechanisms, coordinates that constraints link, to which these belong; shape (m,)."""
    touches = (G != 0.0).astype(np.int64)
    while True:
        more = (touches @ (touches.T @ rows) > 0) | rows
        if np.array_equal(more, rows):
            return rows
        rows = more


def _start_states(layout: Layout, signals: Signals, q: np.ndarray, v: np.ndarray) -> None:
    """Let elements set their own coordinates from the assembled positions (fibres in equilibrium, PID states)."""
    w = new_work(layout)
    packed = Packed(w)
    evaluate_inputs(Packed(signals).table, 0.0, False, packed.table)
    w.q[: layout.n_q], w.v[: layout.n_q] = q, v
    first = {call.element.name: call for call in reversed(layout.dynamics)}
    for call in layout.dynamics:
        hook = getattr(call.element, "start_states", None)
        if hook is None or first[call.element.name] is not call:
            continue
        own = layout.offset[call.element.name]
        for k, (value, rate) in enumerate(hook(layout.system, w.q[call.iq], w.u[call.iu])):
            q[own + k], v[own + k] = value, rate
            w.q[own + k], w.v[own + k] = value, rate

"""Linearisation about any state: dx/dt = A x + B u, y = C x + D u in independent coordinates, with names.

Independent coordinates are some of the model's own, z = q[chosen], in which the others can be told (independent.py);
with w = v[chosen] and the states s of first order, x = (z, w, s) is a chart of all states that the constraints allow.
Then

    zdot = w,     wdot = vdot[chosen],     sdot = v of first-order coordinates

are functions of x and u, and A, B, C, D are their derivatives. One part of them is a central difference: that of
(phi_q v)_q v by q, where the state moves.

    dq = N dz + L (-phi_u du),   dv = N dw + L (-(phi_q v)_q dq - (phi_t)_u du)
    M dvdot + phi_q^T dlam + r_v dv + r_q dq + r_u du = 0
    phi_q dvdot = -[(phi_q vdot)_q + ((phi_q v)_q v)_q] dq - 2 (phi_q v)_q dv - (phi_tt)_u du

An input enters by its value, its rate and its second derivative (a driver's acceleration): B, B_rate and
B_acceleration, and so does D. Constraints' inputs are taken as additive and linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dms_core.analyses.independent import Independent, independent, state_names
from dms_core.analyses.motion_names import motion_in_words
from dms_core.assembly.derivatives.blocks import Blocks, OperatingPoint
from dms_core.assembly.derivatives.input_derivatives import STEP
from dms_core.assembly.model import Model
from dms_core.errors import InputError, SimulationError
from dms_core.results import Result
from dms_core.simulation.dynamics import World

GROWS = 1e-6
"""Real part over the largest |eigenvalue| above which a motion counts as growing: a double 0, as of a body that drifts,
is computed to the square root of rounding."""
OPEN = 1e-5
"""Residual over the sizes of its terms up to which a point counts as a state of the system."""


@dataclass(frozen=True)
class Mode:
    """One eigenvalue, or a pair of conjugate ones, and its shape."""

    eigenvalue: complex
    """[1/s], with an imaginary part of at least 0."""
    shape: np.ndarray
    """dq of all coordinates, complex, largest component 1; shape (n_q,)."""
    state: np.ndarray
    """Eigenvector x, shape (n_x,)."""
    words: str
    """What moves."""

    @property
    def frequency(self) -> float:
        """Frequency of the undamped mode, |eigenvalue| / 2 pi [Hz]."""
        return abs(self.eigenvalue) / (2.0 * np.pi)

    @property
    def damped_frequency(self) -> float:
        """Frequency with which it swings [Hz]; 0 where it does not."""
        return self.eigenvalue.imag / (2.0 * np.pi)

    @property
    def damping(self) -> float:
        """Damping ratio -Re / |eigenvalue| [-]: 0 undamped, 1 and above no swing, below 0 growing."""
        return -self.eigenvalue.real / abs(self.eigenvalue) if self.eigenvalue else 0.0

    @property
    def time_constant(self) -> float:
        """Time in which it falls to 1/e, -1 / Re [s]; negative where it grows, infinite where it does neither."""
        return -1.0 / self.eigenvalue.real if self.eigenvalue.real else np.inf


@dataclass(frozen=True)
class Linearisation:
    """dx/dt = A x + B u + B_rate udot + B_acceleration uddot, y = C x + D u + ... about a point."""

    model: Model
    point: OperatingPoint
    A: np.ndarray
    """Shape (n_x, n_x)."""
    B: np.ndarray
    """By values of inputs, shape (n_x, n_u)."""
    B_rate: np.ndarray
    B_acceleration: np.ndarray
    C: np.ndarray
    """Shape (n_y, n_x)."""
    D: np.ndarray
    D_rate: np.ndarray
    D_acceleration: np.ndarray
    y: np.ndarray
    """Sensors at the point, shape (n_y,)."""
    states: tuple[str, ...]
    """'q.<coordinate>', 'v.<coordinate>' of independent coordinates, then 'q.<state>' of first-order states."""
    inputs: tuple[str, ...]
    outputs: tuple[tuple[str, str], ...]
    """Name and unit."""
    to_q: np.ndarray
    """dq = to_q x, shape (n_q, n_x)."""

    @property
    def eigenvalues(self) -> np.ndarray:
        """All of them [1/s], by rising size."""
        if not len(self.A):
            return np.zeros(0, complex)
        found = np.linalg.eigvals(self.A)
        return found[np.argsort(np.abs(found), kind="stable")]

    @property
    def growth(self) -> float:
        """Largest real part of an eigenvalue [1/s]; -inf without states."""
        return float(np.max(self.eigenvalues.real, initial=-np.inf))

    @property
    def stable(self) -> bool:
        """True where no small disturbance grows."""
        largest = float(np.max(np.abs(self.eigenvalues), initial=0.0))
        return self.growth <= GROWS * largest

    def without(self, coordinates: Sequence[int]) -> Linearisation:
        """The same system without states of first order that nothing depends on, or that never change.

        Args:
            coordinates: their numbers among the model's.
        """
        gone = {f"q.{self.model.layout.names[k]}" for k in coordinates}
        if not gone:
            return self
        kept = np.array([name not in gone for name in self.states])
        rows = {name: getattr(self, name)[kept] for name in ("B", "B_rate", "B_acceleration")}
        return replace(
            self, A=self.A[np.ix_(kept, kept)], C=self.C[:, kept], to_q=self.to_q[:, kept],
            states=tuple(name for name in self.states if name not in gone), **rows,
        )  # fmt: skip

    def modes(self) -> tuple[Mode, ...]:
        """Modes by rising frequency; of a conjugate pair the one with a positive imaginary part."""
        if not len(self.A):
            return ()
        values, vectors = np.linalg.eig(self.A)
        rounding = 1e-12 * float(np.max(np.abs(values)))
        found = []
        for k in np.argsort(np.abs(values), kind="stable"):
            if values[k].imag < 0.0:
                continue
            value = complex(values[k].real, values[k].imag if values[k].imag > rounding else 0.0)
            found.append(self._mode(value, vectors[:, k]))
        return tuple(found)

    def _mode(self, value: complex, x: np.ndarray) -> Mode:
        """A mode with its shape turned so that the largest component is 1."""
        dq = self.to_q @ x
        largest = dq[np.argmax(np.abs(dq))] if len(dq) else 0.0
        if largest:
            dq, x = dq / largest, x / largest
        return Mode(value, dq, x, motion_in_words(self.model, self.point.q, dq.real))

    def as_dict(self) -> dict[str, Any]:
        """Matrices with the names of their rows and columns, for JSON."""
        matrices = ("A", "B", "B_rate", "B_acceleration", "C", "D", "D_rate", "D_acceleration")
        names = {"states": list(self.states), "inputs": list(self.inputs)}
        outputs = {"outputs": [{"name": name, "unit": unit} for name, unit in self.outputs]}
        return {**names, **outputs, **{name: getattr(self, name).tolist() for name in matrices}}


def linearise(
    model: Model | World,
    point: OperatingPoint | None = None,
    *,
    held: Sequence[int] | np.ndarray = (),
    blocks: Blocks | None = None,
) -> Linearisation:
    """Linear system about a state of the model, or about the present state of a world.

    Args:
        model: a compiled model; or a world, which is settled and taken as it is then: its accelerations and multipliers
            become those that belong to its state and inputs.
        point: a state that satisfies the equations, as `World.operating_point` (behind `settle`) or
            `Equilibrium.point` give it; with a model, and with a model only.
        held: coordinates of second order that are no states (an integral that moves nothing).
        blocks: equations there; default: the model's own, under the whole load.

    Raises:
        InputError: the point does not satisfy the equations.
        ModelError: a constraint reads a first-order state.
        SimulationError: no accelerations belong to the state: a motion without inertia.

    Example:
        >>> linear = linearise(World(model))
        >>> linear.states, linear.eigenvalues
    """
    if isinstance(model, World) or point is None:
        model, point = _settled(model, point)
    b = model.derivatives.blocks(point) if blocks is None else blocks
    _check_state(model, point, b)
    G = b.phi_q.toarray()
    at = independent(model, G)
    keep = ~np.isin(at.chosen, np.asarray(held, int))
    at = at._replace(chosen=at.chosen[keep], N=at.N[:, keep])
    n_z, n_f, n_u = len(at.chosen), len(at.first), len(model.layout.input_index)
    n_x = 2 * n_z + n_f
    # Columns: x, then value, rate and second derivative of each input.
    dq, dv = displacements(model, b, at, n_x, n_u)
    rates = rates_of(model, point, b, at, dq, dv)
    dx = np.zeros((n_x, n_x + 3 * n_u))
    dx[:n_z] = dv[at.chosen]
    dx[n_z : 2 * n_z] = rates.a[at.chosen]
    dx[2 * n_z :] = rates.v[at.first]
    s = model.derivatives.sensor_blocks(point)
    dy = s.q @ dq + s.v @ rates.v + s.a @ rates.a + s.lam @ rates.lam + _by_inputs(s.u, n_x)
    cuts = [n_x, n_x + n_u, n_x + 2 * n_u]
    A, B, B_rate, B_acceleration = np.split(dx, cuts, axis=1)
    C, D, D_rate, D_acceleration = np.split(dy, cuts, axis=1)
    states = state_names(model, at.chosen, at.first)
    return Linearisation(
        model, point, A, B, B_rate, B_acceleration, C, D, D_rate, D_acceleration, s.y,
        states, tuple(model.layout.input_index), tuple(model.layout.outputs),
        dq[:, :n_x].copy(),
    )  # fmt: skip


def _settled(world: Model | World, point: OperatingPoint | None) -> tuple[Model, OperatingPoint]:
    """Model and state of a world.

    Raises:
        InputError: both a world and a point were given, or neither.
        SimulationError: no accelerations belong to the state.
    """
    if not isinstance(world, World):
        raise InputError("linearise: Expected an operating point with a model, or a world alone, got a model alone.")
    if point is not None:
        raise InputError("linearise: Expected a world alone, or a model with an operating point, got both.")
    if world.settle() is not Result.SUCCESS:
        raise SimulationError(f"the system cannot be linearised: {world.result.value}")
    return world.model, world.operating_point(behind=True)


@dataclass(frozen=True)
class _Rates:
    """Derivatives of v (with first-order rates), vdot and lam by the columns."""

    v: np.ndarray
    a: np.ndarray
    lam: np.ndarray


def _by_inputs(block: np.ndarray, n_x: int) -> np.ndarray:
    """A block of shape (rows, n_u, 3) as columns behind those of n_x states: values, rates, second derivatives."""
    columns = np.concatenate([block[:, :, k] for k in range(3)], axis=1)
    return np.concatenate([np.zeros((len(block), n_x)), columns], axis=1)


def displacements(model: Model, b: Blocks, at: Independent, n_x: int, n_u: int) -> tuple[np.ndarray, np.ndarray]:
    """dq and dv (first-order rates left out) of each column: n_x states, then n_u inputs, each by three derivatives."""
    n_z, rows = len(at.chosen), at.rows
    dq, dv = np.zeros((model.n_q, n_x + 3 * n_u)), np.zeros((model.n_q, n_x + 3 * n_u))
    dq[:, :n_z] = at.N
    dq[at.first, 2 * n_z + np.arange(len(at.first))] = 1.0
    dq -= at.L @ _by_inputs(b.r3_u, n_x)[rows]
    dv[:, n_z : 2 * n_z] = at.N
    dv -= at.L @ (b.r4_q.toarray()[rows] @ dq + _by_inputs(b.r4_u, n_x)[rows])
    return dq, dv


def rates_of(
    model: Model, point: OperatingPoint, b: Blocks, at: Independent, dq: np.ndarray, dv: np.ndarray,
    more: np.ndarray | None = None,
) -> _Rates:  # fmt: skip
    """Accelerations, first-order rates and multipliers of each column; `more` is added to the acceleration rows."""
    n_u = b.r2_u.shape[1]
    n_s, rows, n_x = len(at.second), at.rows, dq.shape[1] - 3 * n_u
    G, M, C = b.phi_q.toarray()[rows], b.r2_a.toarray(), b.r2_v.toarray()
    unknown = np.concatenate([M[:, at.second], C[:, at.first], G.T], axis=1)
    bound = np.zeros((len(rows), unknown.shape[1]))
    bound[:, :n_s] = G[:, at.second]
    left = np.vstack([unknown, bound])
    open_force = b.r2_q.toarray() @ dq + C @ dv + _by_inputs(b.r2_u, n_x)
    second = _by_inputs(b.r4_u, n_x)[rows]
    # phi_tt of additive inputs: s_u uddot + 2 (s_u udot)_u udot.
    by_acceleration = np.zeros_like(second)
    by_acceleration[:, n_x + 2 * n_u :] = second[:, n_x + n_u : n_x + 2 * n_u]
    by_acceleration[:, n_x + n_u : n_x + 2 * n_u] = 2.0 * second[:, n_x : n_x + n_u]
    W_a = model.constraint_jacobian(point.q, point.a)[3][rows]
    bend = W_a @ dq + 2.0 * b.r4_q.toarray()[rows] @ dv + _third(model, point, dq)[rows] + by_acceleration
    if more is not None:
        bend += more[rows]
    try:
        found = np.linalg.solve(left, -np.vstack([open_force, bend]))
    except np.linalg.LinAlgError:
        raise SimulationError(_massless(model, point, b, at)) from None
    a, v, lam = np.zeros_like(dq), dv.copy(), np.zeros((model.n_phi, dq.shape[1]))
    a[at.second], v[at.first] = found[:n_s], found[n_s : model.n_q]
    lam[rows] = found[model.n_q :]
    return _Rates(v, a, lam)


def _third(model: Model, point: OperatingPoint, dq: np.ndarray) -> np.ndarray:
    """((phi_q v)_q v)_q dq by central differences; 0 at rest."""
    found = np.zeros((model.n_phi, dq.shape[1]))
    if not np.any(point.v):
        return found
    for k in np.flatnonzero(np.any(dq != 0.0, axis=0)):
        h = 10.0 * STEP / max(1.0, float(np.max(np.abs(dq[:, k]))))
        far, near = (
            model.constraint_jacobian(point.q + sign * h * dq[:, k], point.v)[3] @ point.v for sign in (1.0, -1.0)
        )
        found[:, k] = (far - near) / (2.0 * h)
    return found


def _massless(model: Model, point: OperatingPoint, b: Blocks, at: Independent) -> str:
    """The motion without inertia, in words."""
    _, _, motions = np.linalg.svd(at.N.T @ b.r2_a.toarray() @ at.N)
    words = motion_in_words(model, point.q, at.N @ motions[-1]) if len(motions) else "an element state has no rate"
    return f"the system cannot be linearised: no acceleration belongs to a motion without inertia: {words}."


def _check_state(model: Model, point: OperatingPoint, b: Blocks) -> None:
    """Refuse a point at which forces do not balance.

    Raises:
        InputError: names the coordinate or the constraint row.
    """
    layout = model.layout
    G = abs(b.phi_q)
    size = G.T @ np.abs(point.lam) + abs(b.r2_a) @ np.abs(point.a) + abs(b.r2_v) @ np.abs(point.v) + 1.0
    ratio = np.abs(b.r2) / size
    k = int(np.argmax(ratio))
    if not ratio[k] < OPEN:
        raise InputError(
            f"operating point: the equation of '{layout.names[k]}' is open by {b.r2[k]:.4g}; expected a state with the "
            "accelerations and multipliers that belong to it, as behind `World.settle` or of an equilibrium."
        )
    for rows, what in ((b.r3, "position"), (b.r4, "velocity")):
        if len(rows) and not np.abs(rows).max() < OPEN:
            j = int(np.argmax(np.abs(rows)))
            raise InputError(
                f"operating point: constraint '{layout.row_names[j]}' is open by {rows[j]:.4g} in {what}; expected a "
                "state on the constraints."
            )

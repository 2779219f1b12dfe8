"""Static optimisation: which muscles give the net joint moments of a motion, with elastic tendons in equilibrium.

At each time (Crowninshield and Brand 1981)

    min sum a_i^2,    sum_i R_ji [F0 (a fl fv + fp) cos(alpha)]_i = M_j,    low <= a_i <= high

M_j are loads of drivers (inverse.py), R_ji the moment that one newton of muscle i gives about joint j: from the
multipliers that balance the path's dl/dq, so that closed loops and joints in a row need no other treatment. Fibre
lengths are those of tendons that carry the force, fibre velocities their central differences in time, found by
iterating over the whole motion:

    tendon strain from force -> fibre length -> velocity -> full and passive force -> activations -> force

A soft tendon answers to force more than one to one, and neighbours in time excite each other through the velocity: a
share of each new force is taken over. What the muscles cannot give within their bounds is the shortage.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dms_core.analyses.inverse import InverseResult
from dms_core.analyses.kinematic import driver_rows
from dms_core.analyses.least_activations import least_activations
from dms_core.assembly.layout import GROUND_COORDINATES
from dms_core.errors import InputError, SimulationError, choices
from dms_core.model.geometry.path import add_path_gradient, path_table
from dms_core.model.muscles.activation import MINIMUM
from dms_core.model.muscles.fibre import MUSCLE, fibre_state, pennation_cosine, smallest_fibre, tendon_length
from dms_core.model.muscles.muscle import ThelenMuscle
from dms_core.model.system import System

SWEEPS = 200
"""Largest number of iterations between tendon strain and activation."""
RELAXATION, RELAXATION_APART, APART = 0.3, 0.6, 0.05
"""Share of the new tendon force that an iteration takes over (all of it in the first); the larger one for times that
are APART or more [s]."""
SETTLED = 1e-4
"""Estimated error in an activation below which the iteration has settled."""
LEVER = 1e-9
"""Moment arm below which a muscle does not move a joint [m or -]."""


@dataclass(frozen=True)
class MuscleResult:
    """Activations and forces along a motion."""

    t: np.ndarray
    """Times [s], shape (n,)."""
    muscles: tuple[str, ...]
    joints: tuple[str, ...]
    """Drivers whose loads the muscles give."""
    activations: np.ndarray
    """[-], shape (n, m)."""
    forces: np.ndarray
    """Tendon forces [N], shape (n, m)."""
    arms: np.ndarray
    """Moment of one newton about each joint [m], shape (n, d, m)."""
    shortage: np.ndarray
    """Load that the muscles cannot give [Nm or N], shape (n, d)."""
    sweeps: int

    def columns(self) -> dict[str, np.ndarray]:
        """Table by column."""
        found = {"time_s": self.t}
        for k, name in enumerate(self.muscles):
            found |= {f"{name}.activation": self.activations[:, k], f"{name}.tendon_force_N": self.forces[:, k]}
        return found | {f"{name}.shortage": self.shortage[:, k] for k, name in enumerate(self.joints)}


def static_optimisation(
    system: System,
    inverse: InverseResult,
    *,
    muscles: Sequence[str] | None = None,
    loads: Mapping[str, np.ndarray] | None = None,
    bounds: tuple[float, float] = (MINIMUM, 1.0),
) -> MuscleResult:
    """Activations that give the loads of a motion.

    Args:
        system: declares the muscles.
        inverse: the motion, at times that are evenly spaced, and its loads.
        muscles: names; default: all of the system.
        loads: what the muscles must give [Nm or N], by driver, shape (n,) each; default: the loads of the motion. What
            other actuators give is subtracted before.
        bounds: smallest and largest activation.

    Raises:
        InputError: there are no muscles or loads of that name, none of the muscles moves a driven joint, times are
            uneven, or bounds are no numbers from 0.01 to 1 in rising order.
        SimulationError: the iteration does not settle.

    Example:
        >>> inverse = inverse_dynamics(system, times, motion)
        >>> static_optimisation(system, inverse).activations
    """
    t = inverse.t
    names = tuple(muscles if muscles is not None else (f.name for f in system.forces if isinstance(f, ThelenMuscle)))
    if not names:
        raise InputError("muscles: Expected a model with muscles, got none.")
    declared = [system.element(name, ThelenMuscle) for name in names]
    low, high = bounds
    if not MINIMUM <= low < high <= 1.0:
        raise InputError(f"bounds: Expected two activations from {MINIMUM} to 1 in rising order, got {low} and {high}.")
    if len(t) < 3 or np.ptp(np.diff(t)) > 1e-6 * (t[1] - t[0]):
        raise InputError("times: Expected at least three evenly spaced times, since fibre velocities are differences.")
    wanted = dict(inverse.loads)
    for name, load in (loads or {}).items():
        if name not in wanted:
            raise InputError(f"loads: '{name}' is no driver of the motion. Drivers: {choices(wanted)}.")
        wanted[name] = np.asarray(load, float)
    lengths, arms = _geometry(inverse, declared)
    moved = [k for k in range(arms.shape[1]) if np.abs(arms[:, k]).max() > LEVER]
    drivers = list(inverse.loads)
    if not moved:
        raise InputError(f"muscles: none of {choices(names)} moves a driven joint. Drivers: {choices(drivers)}.")
    joints = tuple(drivers[k] for k in moved)
    M = np.stack([wanted[name] for name in joints], axis=1)
    numbers = [np.array(m.numbers()) for m in declared]
    a, force, shortage, sweeps = _settled(numbers, t, lengths, arms[:, moved], M, bounds)
    return MuscleResult(t, names, joints, a, force, arms[:, moved], shortage, sweeps)


def _geometry(inverse: InverseResult, muscles: Sequence[ThelenMuscle]) -> tuple[np.ndarray, np.ndarray]:
    """Muscle-tendon lengths, shape (n, m), and moment arms about all drivers, shape (n, drivers, m)."""
    model, states = inverse.model, inverse.motion.states
    rows = list(driver_rows(model).values())
    lengths = np.zeros((len(states.t), len(muscles)))
    arms = np.zeros((len(states.t), len(rows), len(muscles)))
    tables = [path_table(model.system, m.path) for m in muscles]
    places = [np.concatenate([model.layout.body_indices(b) for b in table.bodies]) for table in tables]
    bodies = slice(model.layout.of_bodies)
    for k in range(len(states.t)):
        q = np.concatenate([states.q[k], GROUND_COORDINATES])
        gradients = np.zeros((model.n_q + 7, len(muscles)))
        for i, (table, at) in enumerate(zip(tables, places, strict=True)):
            local = np.zeros(len(at))
            numbers, integers = np.array(table.numbers, float), np.array(table.integers, np.int32)
            lengths[k, i] = add_path_gradient(integers, 0, numbers, 0, q[at], 1.0, local)
            np.add.at(gradients[:, i], at, local)
        G = model.constraint_jacobian(states.q[k])[2][:, bodies]
        balancing = np.linalg.lstsq(G.T, -gradients[bodies], rcond=1e-12)[0]
        arms[k] = balancing[rows]
    return lengths, arms


def _settled(
    numbers: Sequence[np.ndarray],
    t: np.ndarray,
    lengths: np.ndarray,
    arms: np.ndarray,
    M: np.ndarray,
    bounds: tuple[float, float],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """(activations, tendon forces, shortage, iterations) that agree with each other."""
    n, m = lengths.shape
    interval = float(t[1] - t[0])
    share = RELAXATION_APART if interval >= APART else RELAXATION
    force, a, shortage = np.zeros((n, m)), np.full((n, m), bounds[0]), np.zeros_like(M)
    before, left = math.inf, math.inf
    for sweep in range(1, SWEEPS + 1):
        full, passive = _strengths(numbers, interval, lengths, force, a)
        new = np.zeros_like(a)
        for k in range(n):
            found = least_activations(arms[k] * full[k], M[k] - arms[k] @ passive[k], *bounds)
            new[k], shortage[k] = found.activations, found.shortage
        carried = new * full + passive
        force += (share if sweep > 1 else 1.0) * (carried - force)
        change, a = float(np.abs(new - a).max()), new
        # Changes fall by a rate r from one iteration to the next, and r / (1 - r) of the last is left.
        rate = max(change / before, 1.0 - share) if sweep > 1 else 0.5
        left = change * rate / (1.0 - rate) if rate < 1.0 else math.inf
        if left < SETTLED:
            return a, force, shortage, sweep
        before = change
    raise SimulationError(
        f"static optimisation does not settle: after {SWEEPS} iterations between tendon strain and activation an "
        f"activation may still be wrong by {left:.3g}, expected less than {SETTLED:g}. Take times further apart than "
        f"{interval:g} s, or filter the motion more strongly."
    )


def _strengths(
    numbers: Sequence[np.ndarray], interval: float, lengths: np.ndarray, force: np.ndarray, a: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Force along the tendon at full activation without its passive part, and that part [N], shapes (n, m)."""
    n, m = lengths.shape
    full, passive = np.zeros((n, m)), np.zeros((n, m))
    for i, par in enumerate(numbers):
        least, L0, height = smallest_fibre(par), par[MUSCLE.L0], par[MUSCLE.height]
        along = [max(lengths[k, i] - tendon_length(par, force[k, i]), 1e-3 * L0) for k in range(n)]
        fibre = np.maximum(np.hypot(along, height), least)
        velocity = np.gradient(fibre, interval)
        for k in range(n):
            active, parallel = fibre_state(par, fibre[k], velocity[k], a[k, i])[:2]
            cosine = pennation_cosine(par, fibre[k])[0]
            full[k, i], passive[k, i] = active / a[k, i] * cosine, parallel * cosine
    return full, passive

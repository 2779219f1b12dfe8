"""What the subject's muscles are told: static optimisation on the subject's own internal model.

The subject knows its arm and the load it expects in the hand over the gym rope, not the device that it wears. Along
the reference psi(t) the elbow needs

    M = (J + m_h d^2) psiddot - M_g(psi) + m_h g dy/dpsi + m_w (g + d2l/dt2) dl/dpsi

with J and M_g inertia and gravity's moment of the forearm, m_w the expected weight, l the rope between grip and low
pulley, and the handle as a point of mass m_h in the grip, at the height y and the distance d from the elbow. Of all
activations that give this moment those with the least sum of squares are taken (Crowninshield and Brand 1981; Kaplan
and Heegaard 2001):

    min sum a_i^2,   sum r_i cos(alpha_i) F0_i (a_i fl_i fv_i + fp_i) = M,   0.01 <= a_i <= 1

so that a_i is the multiplier times r_i times the force at full activation, within the limits. Fibre lengths and
velocities are those of a tendon in equilibrium, found by iterating over the whole movement: tendon strain from force,
fibre length from tendon length, fibre velocity by differentiation in time. The activations are the command; what the
muscles receive is the command times the maximum activation, at least 0.01, as a spline in time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from dms_core.errors import InputError
from dms_core.model import Spline, ThelenMuscle
from dms_core.model.muscles.activation import MINIMUM
from dms_core.model.muscles.muscle import fibre_state, pennation_cosine
from dms_core.model.muscles.thelen_curves import TOE_FORCE, TOE_SHAPE
from exo_env.gym_machine import GymMachine
from exo_env.human import MUSCLES, Arm

Course = Callable[[float], tuple[float, float, float]]
"""t [s] -> (psi [rad], its rate [rad/s], its acceleration [rad/s^2])."""
INTERVAL = 0.02
"""Time between samples of the command [s]; far below the time constants of muscles and the movement."""
SWEEPS = 100
"""Largest number of iterations between tendon strain and activation."""
RELAXATION = 0.3
"""Share of the new tendon force that an iteration takes over: a soft tendon answers to force more than one to one."""
SETTLED = 1e-4
"""Change of every activation below which the iteration has settled [-]."""


@dataclass(frozen=True)
class MotorCommand:
    """Activations that the subject wants along a movement."""

    times: np.ndarray
    """[s], shape (n,)."""
    activations: np.ndarray
    """Wanted activations before scaling [-], shape (n, 6), in the order of MUSCLES."""
    moment: np.ndarray
    """Elbow moment that they are meant to give [Nm], shape (n,)."""
    shortage: float
    """Largest moment that the muscles cannot give even at their limits [Nm]."""

    def excitations(self, maximum: float) -> dict[str, Spline]:
        """Course of each muscle's excitation at a maximum activation of 0 to 1."""
        if not 0.0 <= maximum <= 1.0:
            raise InputError(f"maximum activation = {maximum}; a number from 0 to 1 is wanted.")
        scaled = np.maximum(maximum * self.activations, MINIMUM)
        return {m: Spline(times=tuple(self.times), values=tuple(scaled[:, k])) for k, m in enumerate(MUSCLES)}

    def start_activation(self, maximum: float) -> dict[str, float]:
        """Activation of each muscle at the start."""
        return {m: float(max(maximum * self.activations[0, k], MINIMUM)) for k, m in enumerate(MUSCLES)}


@dataclass(frozen=True)
class InternalModel:
    """What the subject knows: its arm, the machine and the weight it expects.

    Args:
        arm: its own arm.
        machine: the gym machine.
        expected_load: mass of the weight that it expects [kg].
    """

    arm: Arm
    machine: GymMachine
    expected_load: float

    def height_and_rope(self, flexion: float) -> tuple[float, float]:
        """(height of the grip [m], rope between grip and low pulley [m])."""
        grip = self.arm.elbow + self.arm.rotation(flexion) @ self.arm.grip
        return float(grip[1]), float(np.linalg.norm(np.array(self.machine.low_pulley) - grip))

    def wanted_moment(self, psi: np.ndarray, rate: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """Moment that the muscles must give along a movement [Nm], shape (n,)."""
        g, handle = float(np.linalg.norm(self.arm.gravity)), self.machine.handle.mass
        h, moment = 1e-4, np.zeros(len(psi))
        for k, (x, v, a) in enumerate(zip(psi, rate, acceleration, strict=True)):
            near, here, far = (np.array(self.height_and_rope(x + d)) for d in (-h, 0.0, h))
            slope, bend = (far - near) / (2 * h), (far - 2 * here + near) / h**2
            rise = slope * a + bend * v * v
            # A longer rope lifts the weight; the handle's inertia is that of a point in the grip.
            weight = slope[1] * self.expected_load * (g + rise[1])
            lifted = handle * (slope[0] * g + float(self.arm.grip @ self.arm.grip) * a)
            moment[k] = self.arm.inertia_about_elbow() * a - self.arm.gravity_moment(x) + weight + lifted
        return moment


def plan(model: InternalModel, reference: Course, duration: float) -> MotorCommand:
    """The command for a movement.

    Args:
        model: what the subject knows.
        reference: the movement.
        duration: of the movement [s].
    """
    times = np.linspace(0.0, duration, round(duration / INTERVAL) + 1)
    psi, rate, acceleration = np.array([reference(t) for t in times]).T
    moment = model.wanted_moment(psi, rate, acceleration)
    muscles = [model.arm.muscle(m) for m in MUSCLES]
    geometry = np.array([[model.arm.muscle_geometry(m, x) for m in MUSCLES] for x in psi])
    lengths, arms = geometry[..., 0], geometry[..., 1]
    activations, tendon_force = np.full(lengths.shape, MINIMUM), np.zeros(lengths.shape)
    shortage = np.zeros(len(times))
    for _ in range(SWEEPS):
        before = activations
        full, passive = _forces(muscles, times, lengths, tendon_force, activations)
        activations, shortage = _least_squares(moment - np.sum(arms * passive, axis=1), arms * full)
        tendon_force = tendon_force + RELAXATION * (activations * full + passive - tendon_force)
        if np.max(np.abs(activations - before)) < SETTLED:
            break
    return MotorCommand(times, activations, moment, float(np.max(np.abs(shortage))))


def _forces(
    muscles: list[ThelenMuscle],
    times: np.ndarray,
    lengths: np.ndarray,
    tendon_force: np.ndarray,
    activations: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Force along the tendon at full activation without the passive part, and that part [N], shapes (n, 6)."""
    full, passive = np.zeros(lengths.shape), np.zeros(lengths.shape)
    for i, muscle in enumerate(muscles):
        par = np.array(muscle.numbers())
        along = lengths[:, i] - [_tendon_length(par, f) for f in tendon_force[:, i]]
        fibre = np.hypot(np.maximum(along, 1e-3 * par[1]), par[3])
        velocity = np.gradient(fibre, times)
        for k, (x, v, a) in enumerate(zip(fibre, velocity, activations[:, i], strict=True)):
            active, parallel, *_ = fibre_state(par, x, v, a)
            cosine, _ = pennation_cosine(par, x)
            full[k, i], passive[k, i] = active / a * cosine, parallel * cosine
    return full, passive


def _tendon_length(par: np.ndarray, force: float) -> float:
    """Length of the tendon that carries a force [m]: the inverse of the tendon curve."""
    f, e_toe, k_lin = force / par[0], par[10], par[11]
    if f <= 0.0:
        strain = 0.0
    elif f <= TOE_FORCE:
        strain = e_toe / TOE_SHAPE * math.log1p(f * math.expm1(TOE_SHAPE) / TOE_FORCE)
    else:
        strain = e_toe + (f - TOE_FORCE) / k_lin
    return float(par[2] * (1.0 + strain))


def _least_squares(moment: np.ndarray, full: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Activations of least squares that give each moment, and what is left over [Nm].

    Args:
        moment: wanted of the active forces [Nm], shape (n,).
        full: moment of each muscle at full activation [Nm], shape (n, 6).
    """
    activations, left = np.zeros(full.shape), np.zeros(len(moment))
    for k, (wanted, f) in enumerate(zip(moment, full, strict=True)):

        def shares(multiplier: float, f: np.ndarray = f) -> np.ndarray:
            return np.clip(multiplier * f, MINIMUM, 1.0)

        def surplus(multiplier: float, f: np.ndarray = f, wanted: float = wanted) -> float:
            return float(f @ shares(multiplier)) - wanted

        # Beyond this multiplier every muscle is at a limit.
        most = 1.0 / max(float(np.min(np.abs(f))), 1e-6)
        if surplus(-most) >= 0.0 or surplus(most) <= 0.0:
            multiplier = -most if surplus(-most) >= 0.0 else most
        else:
            multiplier = brentq(surplus, -most, most, xtol=1e-12)
        activations[k], left[k] = shares(multiplier), surplus(multiplier)
    return activations, left

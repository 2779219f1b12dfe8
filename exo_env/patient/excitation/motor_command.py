"""The motor command of a subject: static optimisation on the subject's own internal model.

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

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dms_core.errors import InputError, SimulationError
from dms_core.model import Spline
from dms_core.model.muscles.activation import MINIMUM
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.patient.excitation.static_optimisation import (
    ArmTable,
    LoadTable,
    muscle_moment,
    needed_moment,
    needed_moments,
    planned,
)

Course = Callable[[float], tuple[float, float, float]]
"""A function from a time [s] to psi [rad], its rate [rad/s] and its acceleration [rad/s^2]."""
INTERVAL = 0.02
"""Time between samples of the command [s]; far below the time constants of muscles and the movement."""
SWEEPS = 100
"""Largest number of iterations between tendon strain and activation."""
RELAXATION, RELAXATION_APART = 0.3, 0.6
"""Share of the new tendon force that an iteration takes over (all of it in the first), for samples INTERVAL apart and
for samples 0.05 s apart or more. A soft tendon answers to force more than one to one, and from 0.4 on neighbours in
time, INTERVAL apart, excite each other through the velocity; those further apart do not."""
SETTLED = 1e-4
"""Estimated error in an activation below which the iteration has settled [-]."""


@dataclass(frozen=True)
class MotorCommand:
    """Activations that the subject wants along a movement."""

    times: np.ndarray
    """Times of the command [s], shape (n,)."""
    activations: np.ndarray
    """Wanted activations before scaling [-], shape (n, m), in the order of `muscles`."""
    moment: np.ndarray
    """Elbow moment that they are meant to give [Nm], shape (n,)."""
    shortage: float
    """Largest moment that the muscles cannot give even at their limits [Nm]."""
    muscles: tuple[str, ...]
    """Names of the muscles, shape (m,)."""

    def excitations(self, maximum: float | np.ndarray) -> dict[str, Spline]:
        """Excitation of each muscle over time.

        Args:
            maximum: maximum activation of the subject, or of each muscle, shape (m,), 0 to 1 [-].

        Raises:
            InputError: it is no number from 0 to 1.
        """
        if not np.all((np.asarray(maximum) >= 0.0) & (np.asarray(maximum) <= 1.0)):
            raise InputError(f"maximum activation = {maximum}: expected a number from 0 to 1.")
        scaled = np.maximum(maximum * self.activations, MINIMUM)
        return {m: Spline(times=tuple(self.times), values=tuple(scaled[:, k])) for k, m in enumerate(self.muscles)}

    def start_activation(self, maximum: float | np.ndarray) -> dict[str, float]:
        """Activation of each muscle at the start [-], at a maximum activation as in `excitations`."""
        return dict(zip(self.muscles, np.maximum(maximum * self.activations[0], MINIMUM).tolist(), strict=True))


@dataclass(frozen=True)
class InternalModel:
    """What the subject knows: its arm, the machine and the weight it expects, as tables for the compiled iteration."""

    arm: ArmTable
    load: LoadTable
    muscles: tuple[str, ...]
    """Names of the muscles, in the order of the arm's table."""

    @classmethod
    def of(cls, arm: Arm, machine: GymMachine, expected_load: float) -> InternalModel:
        """The internal model of a subject.

        Args:
            arm: the subject's own arm.
            machine: the gym machine.
            expected_load: mass of the weight that the subject expects [kg].
        """
        return cls(arm_table(arm), load_table(arm, machine, expected_load), arm.muscles)

    def resting_moment(self, flexion: float) -> float:
        """Moment that must be given about the elbow to hold arm and load at rest [Nm]."""
        return needed_moment(self.arm, self.load, flexion, 0.0, 0.0)

    def muscle_moment(self, flexion: float, activations: np.ndarray) -> float:
        """Moment that the muscles give about the elbow at rest [Nm]; activations [-], shape (n,), at least 0.01."""
        return muscle_moment(self.arm, flexion, np.asarray(activations, float))


def arm_table(arm: Arm) -> ArmTable:
    """The arm for the compiled iteration."""
    paths = [arm.path(m, welded=True) for m in arm.muscles]
    points = [p for path in paths for p in path]
    return ArmTable(
        muscles=np.array([arm.muscle(m).numbers() for m in arm.muscles]),
        sign=arm.signs,
        first=np.cumsum([0, *(len(path) for path in paths)]),
        moving=np.array([p.body == "forearm" for p in points]),
        points=np.array([p.point for p in points]),
        axis=np.ascontiguousarray(arm.axis),
        elbow=np.ascontiguousarray(arm.elbow),
    )


def load_table(arm: Arm, machine: GymMachine, expected_load: float) -> LoadTable:
    """The load of the arm, for the compiled iteration."""
    forearm, handle = arm.segments["forearm"], machine.handle
    return LoadTable(
        inertia=arm.inertia_about_elbow(),
        mass=float(forearm.mass),
        centre_of_mass=forearm.centre_of_mass,
        grip=arm.grip,
        handle=handle.mass,
        weight=float(expected_load),
        pulley=np.array(machine.low_pulley),
        gravity=np.array(arm.gravity),
    )


def plan(model: InternalModel, reference: Course, duration: float) -> MotorCommand:
    """The command for a movement.

    Args:
        model: what the subject knows.
        reference: the movement.
        duration: length of the movement [s].

    Raises:
        SimulationError: the iteration between tendon strain and activation does not settle.
    """
    times = np.linspace(0.0, duration, round(duration / INTERVAL) + 1)
    return plan_course(model, times, np.array([reference(t) for t in times]))


def plan_course(model: InternalModel, times: np.ndarray, course: np.ndarray) -> MotorCommand:
    """The command for a movement that is given as a table.

    Args:
        model: what the subject knows.
        times: evenly spaced times [s], shape (n,).
        course: psi [rad], its rate [rad/s] and its acceleration [rad/s^2], shape (n, 3).

    Raises:
        SimulationError: the iteration between tendon strain and activation does not settle.
    """
    moment, activations = np.zeros(len(times)), np.zeros((len(times), len(model.muscles)))
    along, weights = np.ascontiguousarray(course, dtype=float), np.full(len(times), model.load.weight)
    needed_moments(model.arm, model.load, weights, along, moment)
    shortage, left = planned(
        model.arm, float(times[1] - times[0]), along, moment, SWEEPS, RELAXATION, SETTLED, activations
    )
    if not left < SETTLED:
        raise unsettled(left, float(times[-1]))
    return MotorCommand(times, activations, moment, shortage, model.muscles)


def unsettled(left: float, duration: float) -> SimulationError:
    """The error of a command that does not settle in a movement of that duration [s]."""
    return SimulationError(
        f"the motor command does not settle: after {SWEEPS} iterations between tendon strain and activation an "
        f"activation may still be wrong by {left:.3g}, expected less than {SETTLED:g}. Check the person's muscles and "
        f"the movement of {duration:.4g} s."
    )

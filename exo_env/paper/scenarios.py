"""The four scenarios of the paper (sect. 4.2): one exercise, shared in four ways by subject and device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from pydantic import Field

from dms_core import Model, SolverOptions, Trajectory, simulate
from dms_core.errors import InputError
from dms_core.model import MinimumJerk
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem, Proprioception
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.patient.motor_command import InternalModel, MotorCommand, plan
from exo_env.settings import Settings

FILES = ("1_healthy", "2_passive", "3_impaired", "4_heavy")
SAMPLE = 0.005
"""Interval of the tables and of every number taken from them [s]."""


class Exercise(Settings):
    """The movement and how the subject feels it."""

    times: tuple[float, ...] = Field(min_length=2, description="knots of the reference [s]")
    angles_deg: tuple[float, ...] = Field(description="elbow angle at the knots [deg]")
    duration: float = Field(gt=0.0, description="[s]")
    proprioception: Proprioception

    @property
    def reference(self) -> MinimumJerk:
        """psi(t) [rad]."""
        return MinimumJerk(times=self.times, values=tuple(np.radians(self.angles_deg)))

    @property
    def turning(self) -> float:
        """Time that separates the lifting half from the release half: the middle of the movement [s]."""
        return 0.5 * (self.times[0] + self.times[-1])

    def course(self, t: float) -> tuple[float, float, float]:
        """(psi [rad], its rate [rad/s], its acceleration [rad/s^2]) at a time [s]."""
        pieces = self.reference.pieces()
        k = max(int(np.searchsorted(pieces.t, t, side="right")) - 1, 0)
        curve = np.polynomial.Polynomial(pieces.c[k])
        x = t - pieces.t[k]
        return float(curve(x)), float(curve.deriv()(x)), float(curve.deriv(2)(x))


class Scenario(Settings):
    """One way of doing the exercise, as in configs/scenarios."""

    title: str = Field(description="shown in figures")
    maximum_activation: float = Field(ge=0.0, le=1.0, description="factor on the subject's command [-]")
    assistance: float = Field(ge=0.0, le=1.0, description="authority of the rope controllers [-]")
    weight: float = Field(gt=0.0, description="weight on the machine [kg]")
    expected_weight: float = Field(gt=0.0, description="weight that the subject expects [kg]")


def load_scenarios() -> tuple[Exercise, list[Scenario]]:
    """The paper's exercise and its four scenarios."""
    exercise = Exercise.from_config("scenarios/exercise.yaml")
    return exercise, [Scenario.from_config(f"scenarios/{name}.yaml") for name in FILES]


@dataclass(frozen=True)
class ScenarioRun:
    """A scenario that was simulated."""

    scenario: Scenario
    exercise: Exercise
    command: MotorCommand
    trajectory: Trajectory

    @cached_property
    def times(self) -> np.ndarray:
        """Times of the table [s]."""
        end = self.trajectory.t[-1]
        return np.minimum(np.arange(0, int(end / SAMPLE + 1e-6) + 1) * SAMPLE, end)

    @cached_property
    def values(self) -> dict[str, np.ndarray]:
        """Every sensor at these times, by name."""
        return self.trajectory.sensors(self.times)

    @cached_property
    def reference(self) -> np.ndarray:
        """psi at these times [rad]."""
        return np.array([self.exercise.course(t)[0] for t in self.times])


def build(scenario: Scenario, exercise: Exercise, ecosystem: Ecosystem | None = None) -> tuple[Model, MotorCommand]:
    """The compiled model of a scenario and the subject's command.

    Args:
        scenario: how the exercise is shared.
        exercise: the movement.
        ecosystem: person, device and machine; weight and proprioception are set here. Default: the paper's system.
    """
    base = ecosystem or Ecosystem()
    if base.machine is None:
        raise InputError("a scenario needs a gym machine; this ecosystem has machine = None.")
    felt = exercise.proprioception
    scaled = felt.changed(gain=felt.gain * scenario.maximum_activation)
    joined = base.changed(weight=scenario.weight, proprioception=scaled)
    command = _planned(Arm(base.person), base.machine, scenario.expected_weight, exercise)
    system = joined.system(
        float(np.radians(exercise.angles_deg[0])),
        exercise.reference,
        command.excitations(scenario.maximum_activation),
        assistance=scenario.assistance,
        start_activation=command.start_activation(scenario.maximum_activation),
    )
    return Model(system), command


@lru_cache(maxsize=16)
def _planned(arm: Arm, machine: GymMachine, expected_weight: float, exercise: Exercise) -> MotorCommand:
    """The command; the scenarios share it as long as the subject expects the same."""
    return plan(InternalModel.of(arm, machine, expected_weight), exercise.course, exercise.duration)


def run(
    scenario: Scenario,
    exercise: Exercise,
    ecosystem: Ecosystem | None = None,
    options: SolverOptions | None = None,
    progress: Callable[[float], None] | None = None,
) -> ScenarioRun:
    """Simulate a scenario; `progress` is called with the time reached [s].

    Raises:
        SimulationError: the run did not reach its end.
    """
    model, command = build(scenario, exercise, ecosystem)
    trajectory = simulate(model, exercise.duration, options, progress).check()
    return ScenarioRun(scenario, exercise, command, trajectory)

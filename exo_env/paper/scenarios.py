"""Scenarios (sect. 4.2 of the paper): one exercise, shared in one way or another by subject and device.

The paper has four, in configs/scenarios. One's own is a `Scenario` and an `Exercise`, in Python or as YAML files of the
same keys, done with any arm, device and machine:

    exercise, (healthy, *_) = load_scenarios()
    weak = healthy.changed(title="a third of the activation", maximum_activation=0.33, assistance=1.0)
    done = run(weak, exercise, Ecosystem(device=Exoskeleton.named("mine.yaml")))
    done.times, done.values["elbow_angle.angle"], done.values["exo_moment"]

`python -m exo_env scenarios` makes tables and figures of such runs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from pydantic import Field, model_validator

from dms_core import Model, SolverOptions, Trajectory, simulate
from dms_core.errors import InputError
from dms_core.model import MinimumJerk
from exo_env.ecosystem.arm import USUAL_RANGE_DEG, Arm
from exo_env.ecosystem.ecosystem import Ecosystem, Proprioception
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.patient.excitation.motor_command import InternalModel, MotorCommand, plan
from exo_env.settings import Settings

FILES = ("1_healthy", "2_passive", "3_impaired", "4_heavy")
"""Names of the paper's four scenarios, in its order."""
SAMPLE = 0.005
"""Interval of the tables and of every number taken from them [s]."""
SHORTEST = 0.1
"""Shortest exercise [s], a few samples of the motor command."""


class Exercise(Settings):
    """The movement and how the subject feels it, as in configs/scenarios/exercise.yaml.

    The elbow goes from knot to knot with moves of minimum jerk, and rests before the first and behind the last.

    Example:
        >>> exercise = Exercise(times=(0.2, 1.2), angles_deg=(30, 80), duration=1.5, proprioception={"gain": 0.2})
        >>> round(exercise.turning, 3)
        0.7
    """

    times: tuple[float, ...] = Field(min_length=2, description="knots of the reference [s], from 0, in rising order")
    angles_deg: tuple[float, ...] = Field(description="elbow angle at each knot [deg]")
    duration: float = Field(ge=SHORTEST, le=120.0, description="of the exercise [s], at least the last of the times")
    proprioception: Proprioception

    @model_validator(mode="after")
    def _possible(self):
        """Refuse knots that no elbow can follow."""
        times, angles, (low, high) = list(self.times), list(self.angles_deg), USUAL_RANGE_DEG
        if len(angles) != len(times):
            raise ValueError(f"angles_deg = {angles}: expected {len(times)} angles, one for each of the times")
        if times[0] < 0.0 or any(b <= a for a, b in zip(times[:-1], times[1:], strict=True)):
            raise ValueError(f"times = {times}: expected times from 0 s in rising order")
        if self.duration < times[-1]:
            raise ValueError(f"duration = {self.duration}: expected at least the last of the times, {times[-1]} s")
        if any(not low <= a <= high for a in angles):
            raise ValueError(f"angles_deg = {angles}: expected angles from {low:g} to {high:g} deg")
        return self

    @property
    def reference(self) -> MinimumJerk:
        """The reference psi(t) [rad]."""
        return MinimumJerk(times=self.times, values=tuple(np.radians(self.angles_deg)))

    @property
    def turning(self) -> float:
        """Time that separates the lifting half from the release half: the middle of the movement [s]."""
        return 0.5 * (self.times[0] + self.times[-1])

    def course(self, t: float) -> tuple[float, float, float]:
        """psi [rad], its rate [rad/s] and its acceleration [rad/s^2] at a time [s]."""
        pieces = self.reference.pieces()
        k = max(int(np.searchsorted(pieces.t, t, side="right")) - 1, 0)
        curve = np.polynomial.Polynomial(pieces.c[k])
        x = t - pieces.t[k]
        return float(curve(x)), float(curve.deriv()(x)), float(curve.deriv(2)(x))


class Scenario(Settings):
    """One way of sharing the exercise between subject and device, as in configs/scenarios.

    Example:
        >>> weak = Scenario(title="a third", maximum_activation=0.33, assistance=1, weight=1, expected_weight=1)
        >>> weak.changed(weight=2.0).weight
        2.0
    """

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
    """A scenario that was simulated, and what came of it."""

    scenario: Scenario
    exercise: Exercise
    command: MotorCommand
    trajectory: Trajectory

    @cached_property
    def times(self) -> np.ndarray:
        """Times of the table [s], shape (n,)."""
        end = self.trajectory.t[-1]
        return np.minimum(np.arange(0, int(end / SAMPLE + 1e-6) + 1) * SAMPLE, end)

    @cached_property
    def values(self) -> dict[str, np.ndarray]:
        """Every component of the model's sensors at these times, by name, each of shape (n,)."""
        return self.trajectory.sensors(self.times)

    @cached_property
    def reference(self) -> np.ndarray:
        """psi at these times [rad], shape (n,)."""
        return np.array([self.exercise.course(t)[0] for t in self.times])


def build(scenario: Scenario, exercise: Exercise, ecosystem: Ecosystem | None = None) -> tuple[Model, MotorCommand]:
    """The compiled model of a scenario and the subject's command.

    Args:
        scenario: how the exercise is shared.
        exercise: the movement.
        ecosystem: person, arm, device and machine; weight and proprioception are set here. Default: the paper's system.

    Raises:
        InputError: the ecosystem has no gym machine.
        SimulationError: the subject's command does not settle.

    Example:
        >>> exercise, scenarios = load_scenarios()
        >>> model, command = build(scenarios[2], exercise, Ecosystem(person=Person(height=1.6)))
        >>> command.activations.shape
        (276, 6)
    """
    base = ecosystem or Ecosystem()
    if base.machine is None:
        raise InputError("a scenario needs a gym machine; this ecosystem has machine = None.")
    felt = exercise.proprioception
    scaled = felt.changed(gain=felt.gain * scenario.maximum_activation)
    joined = base.changed(weight=scenario.weight, proprioception=scaled)
    command = _planned(base.arm(), base.machine, scenario.expected_weight, exercise)
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
    """Simulate a scenario.

    Args:
        scenario: how the exercise is shared.
        exercise: the movement.
        ecosystem: person, arm, device and machine; weight and proprioception are set here. Default: the paper's system.
        options: options of the solver.
        progress: is called with the time reached [s].

    Raises:
        InputError: the ecosystem has no gym machine.
        SimulationError: the run did not reach its end, or the subject's command does not settle.

    Example:
        >>> exercise, scenarios = load_scenarios()
        >>> done = run(scenarios[0].changed(weight=2.0), exercise, Ecosystem(subject="arm26"))
        >>> round(float(done.values["elbow_angle.angle"].max()), 2)  # [rad]
        1.48
    """
    model, command = build(scenario, exercise, ecosystem)
    trajectory = simulate(model, exercise.duration, options, progress).check()
    return ScenarioRun(scenario, exercise, command, trajectory)

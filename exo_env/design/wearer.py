"""A patient who does an exercise of a few seconds in a device: the system that a design is judged by.

As in the paper's scenarios: the patient plans the movement for the weight that he expects, and the device follows the
reference with its PID on all ropes. Of a patient count the body, strength, both maximum activations, the muscles' time
constants, the expected load, and the gain and delay of proprioception; delays of the command, co-contraction, fatigue,
also that at the start, slacking and effort at the start, spasticity and tremor, which need the compiled worlds of the
environments, do not.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from pydantic import Field

from dms_core import Model
from dms_core.errors import SimulationError
from dms_core.model import RopeSensor, System
from exo_env.design.space import Design
from exo_env.ecosystem.ecosystem import Ecosystem, Proprioception
from exo_env.ecosystem.subject import DEFAULT, AnySubject, read_subject
from exo_env.ecosystem.worn_exoskeleton import Misalignment
from exo_env.paper.scenarios import Exercise
from exo_env.patient.excitation.motor_command import InternalModel, MotorCommand, plan
from exo_env.patient.patient import Patient
from exo_env.patient.population import Population
from exo_env.settings import Settings

EXERCISE = "design/exercise.yaml"
"""The movement that a device is designed on without one of one's own."""
LEAST_SAMPLES = 40
"""Least number of times at which an exercise is looked at: as many as two seconds have at the usual interval."""


def rate_sensor(rope: str) -> str:
    """Name of the sensor of a rope's rate of length."""
    return f"{rope}_rate"


class Setting(Settings):
    """What every wearer has in common."""

    exercise: Exercise = Field(default_factory=lambda: Exercise.from_config(EXERCISE), description="the movement")
    weight: float = Field(default=1.0, gt=0.0, le=50.0, description="mass of the weight on the machine [kg]")
    subject: AnySubject = Field(default_factory=lambda: read_subject(DEFAULT), description="anatomy")
    misalignment: Misalignment = Field(default=Misalignment(), description="how the device is worn")


class Wearer:
    """A patient with an exercise.

    Args:
        name: by which messages speak of the patient.
        patient: the patient.
        setting: what is the same for all patients.
        like: a wearer whose orders of elimination are taken over where the structure is the same.

    """

    def __init__(self, name: str, patient: Patient, setting: Setting, like: Wearer | None = None) -> None:
        self.name, self.patient, self.exercise = name, patient, setting.exercise
        # An ecosystem has one gain, as in the paper's scenarios: the flexors' weakness scales the extensors', too.
        reflex = patient.feedback_gain * patient.maximum_activation_flexors
        self._ecosystem = Ecosystem(
            person=patient.person, subject=setting.subject, weight=setting.weight, misalignment=setting.misalignment,
            proprioception=Proprioception(gain=reflex, delay=patient.feedback_delay),
        )  # fmt: skip
        self._like = like
        self._first: Model | None = None

    @cached_property
    def _command(self) -> MotorCommand:
        e = self._ecosystem
        assert e.machine is not None
        expected = e.weight * self.patient.expected_load
        try:
            return plan(InternalModel.of(e.arm(), e.machine, expected), self.exercise.course, self.exercise.duration)
        except SimulationError as error:
            raise SimulationError(f"{self.name}: {error}") from None

    @cached_property
    def _most(self) -> np.ndarray:
        """Maximum activation of each muscle [-]."""
        p, signs = self.patient, self._ecosystem.arm().signs
        return np.where(signs > 0.0, p.maximum_activation_flexors, p.maximum_activation_extensors)

    def system(self, design: Design) -> System:
        """The patient in a device, with sensors of all that objectives need.

        Raises:
            SimulationError: the patient's command does not settle.
        """
        worn = self._ecosystem.changed(device=design.device, cuff=design.cuff)
        declared = worn.system(
            float(np.radians(self.exercise.angles_deg[0])),
            self.exercise.reference,
            self._command.excitations(self._most),
            start_activation=self._command.start_activation(self._most),
            muscle_times=self.patient.time_constants(worn.arm()),
        )
        rates = [RopeSensor(name=rate_sensor(r), rope=r, components=("rate",)) for r in design.device.ropes]
        sections = ("bodies", "constraints", "forces", "inputs")
        rest = {section: declared.own(section) for section in sections}
        return System(declared.name, sensors=(*declared.sensors, *rates), **rest)  # type: ignore[arg-type]

    def model(self, design: Design) -> Model:
        """The compiled system; orders of elimination are those of the first, so that no run depends on the way."""
        if self._first is None:
            known = None if self._like is None else self._like._first
            self._first = Model(self.system(design), like=known)
            return self._first
        return Model(self.system(design), like=self._first)


def wearers(source: Population, seed: int, count: int, setting: Setting) -> list[Wearer]:
    """The first patients that a population draws with a seed."""
    draws, found = np.random.default_rng(seed), list[Wearer]()
    for k in range(count):
        patient = source.sample(draws)
        found.append(Wearer(f"patient {k + 1}", patient, setting, found[0] if found else None))
    return found


def exercise_times(exercise: Exercise, interval: float) -> Sequence[float]:
    """Equidistant times of an exercise behind its start [s], the last one its end.

    Args:
        exercise: the movement.
        interval: largest time between two of them [s]; a short exercise has LEAST_SAMPLES, nearer to each other.
    """
    # Rounding must not add a sample to an exercise of whole intervals.
    count = max(math.ceil(exercise.duration / interval - 1e-9), LEAST_SAMPLES)
    return [exercise.duration * (k + 1) / count for k in range(count)]


def tracking_error(exercise: Exercise, times: Iterable[float], angle: np.ndarray) -> float:
    """Root of the mean square by which the elbow's angle [rad] at some times [s] is off the movement [deg]."""
    off = np.degrees(angle - [exercise.course(t)[0] for t in times])
    return float(np.sqrt((off**2).mean()))

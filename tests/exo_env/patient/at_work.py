"""A patient at work, period by period, for tests of the compiled effort."""

from __future__ import annotations

import math

import numpy as np

from exo_env.ecosystem.arm import Arm
from exo_env.patient.excitation.effort import (
    PRESENT,
    EffortState,
    new_effort,
    reset_effort,
    start_excitation,
    step_effort,
)
from exo_env.patient.patient import MIDDLE, PATIENT, Patient

MUSCLES, SIGN = Arm().muscles, Arm().signs


class AtWork:
    """A patient whose tremor takes one number from a generator at each reset and one at each step."""

    def __init__(self, patient: Patient, period: float, generator: np.random.Generator, *, feedback: bool = True):
        self.period, self.generator, self.numbers = period, generator, patient.row()
        if not feedback:
            self.numbers[PATIENT.feedback_gain] = 0.0
        self.state: EffortState = new_effort(SIGN, period)

    def reset(self, wanted: np.ndarray, angle: float = MIDDLE) -> np.ndarray:
        """As one who has wanted `wanted` for long; gives the excitations of that, without tremor."""
        phase = self.generator.uniform(0.0, 2.0 * math.pi)
        reset_effort(self.numbers, self.state, self.period, np.asarray(wanted, float), angle, phase)
        return np.array([start_excitation(self.state, k) for k in range(len(SIGN))])

    def step(
        self, wanted: np.ndarray, *, error: float = 0.0, error_rate: float = 0.0, angle: float = MIDDLE,
        rate: float = 0.0,
    ) -> np.ndarray:  # fmt: skip
        """Excitations at the end of the coming period."""
        out, noise = np.empty(len(SIGN)), self.generator.standard_normal()
        step_effort(
            self.numbers, self.state, self.period, np.asarray(wanted, float), error, error_rate, angle, rate, noise, out
        )
        return out

    @property
    def effort(self) -> float:
        return float(self.state.present[PRESENT.effort])

    @property
    def phase(self) -> float:
        return float(self.state.present[PRESENT.phase])

    @property
    def fatigued(self) -> np.ndarray:
        return self.state.fatigued.copy()

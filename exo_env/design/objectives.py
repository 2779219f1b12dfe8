"""What a design lowers, as one smooth number a run.

    J = (1/N sum_k sum_i s_i(t_k)^p)^(1/p)

over N times t_k of the exercise. s_i is the tension of rope i [N], the size of the elbow's reaction force [N] (one i),
or the mechanical power of motor i, -tension x rate of length [W]. A p-norm of times is the RMS for p = 2 and comes
near the peak as p grows, from below: with n samples near the peak, J lies at (n/N)^(1/p) of it. p = 20 for both peaks,
2 for power. A population counts by the mean of J over its patients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dms_core.errors import InputError, choices
from dms_core.sensitivity.run import Output
from exo_env.design.wearer import rate_sensor
from exo_env.ecosystem.worn_exoskeleton import motor_name

PEAK, RMS = 20, 2
"""p of a smoothed peak, and of the root of the mean square; both even, so that a sign does not count."""
Signals = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""From readings, shape (N, signals, components), s, shape (N, signals), and ds by them, shaped as the readings."""


@dataclass(frozen=True)
class Objective:
    """A quantity that a design lowers."""

    title: str
    unit: str
    p: int
    readings: Callable[[Sequence[str]], list[list[str]]]
    """From the names of the ropes, names of outputs: a list of components for each signal."""
    signals: Signals

    def outputs(self, ropes: Sequence[str], times: Sequence[float]) -> list[Output]:
        """What is read of a run, in the order of times, signals, components."""
        names = [name for signal in self.readings(ropes) for name in signal]
        return [Output(name, t) for t in times for name in names]

    def of(self, ropes: Sequence[str], readings: np.ndarray) -> tuple[float, np.ndarray]:
        """J and its derivative by the readings of a run, both in the order of `outputs`."""
        signals = self.readings(ropes)
        shaped = readings.reshape(-1, len(signals), len(signals[0]))
        s, by_readings = self.signals(shaped)
        largest = np.abs(s).max()
        if largest == 0.0:
            return 0.0, np.zeros(len(readings))
        # Scaled by the largest: the twentieth power of a force overflows otherwise.
        part = s / largest
        mean = (part**self.p).sum() / len(s)
        slope = mean ** (1.0 / self.p - 1.0) * part ** (self.p - 1) / len(s)
        return float(largest * mean ** (1.0 / self.p)), (slope[:, :, None] * by_readings).ravel()


def _itself(readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return readings[:, :, 0], np.ones_like(readings)


def _size(readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    size = np.sqrt((readings**2).sum(axis=2))
    return size, readings / np.maximum(size, 1e-300)[:, :, None]


def _power(readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    tension, rate = readings[:, :, 0], readings[:, :, 1]
    return -tension * rate, -np.stack([rate, tension], axis=2)


def tension_state(rope: str) -> str:
    """Name of the state that is the tension of a rope."""
    return f"q.{motor_name(rope)}.tension"


OBJECTIVES = {
    "peak_tension": Objective(
        "peak rope tension", "N", PEAK, lambda ropes: [[tension_state(r)] for r in ropes], _itself
    ),
    "elbow_reaction": Objective(
        "peak elbow reaction", "N", PEAK, lambda ropes: [[f"elbow_reaction.F{axis}" for axis in "xyz"]], _size
    ),
    "motor_power": Objective(
        "RMS motor power", "W", RMS, lambda ropes: [[tension_state(r), rate_sensor(r)] for r in ropes], _power
    ),
}  # fmt: skip


def objective(name: str) -> Objective:
    """An objective by name.

    Raises:
        InputError: there is none of this name; lists those there are.
    """
    if name not in OBJECTIVES:
        raise InputError(f"objective = '{name}': expected one of {choices(OBJECTIVES)}.")
    return OBJECTIVES[name]

"""What is measured of an episode, from the environment's readings without noise at control times.

Work is mechanical and positive: of each party, the integral of the positive part of its moment times the joint's rate.
Shares are of the sum of both, so that a party which brakes the other earns nothing. An episode that an event cuts short
is measured up to its end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from exo_env.tasks.movement import Repetition

SPARC_CUTOFF, SPARC_THRESHOLD, SPARC_PADDING = 10.0, 0.05, 4
"""Largest frequency [Hz], least amplitude [-], doublings of the transform's length (Balasubramanian et al. 2015)."""
FEWEST_SAMPLES = 8
"""Of a speed profile worth a smoothness."""


@dataclass(frozen=True)
class Measure:
    """A column of the results."""

    name: str
    label: str
    unit: str
    rate: bool = False
    """The numbers are 0 or 1, whose mean says how many; their interquartile mean would hide the few."""


MEASURES = (
    Measure("return", "return", "-"),
    Measure("tracking_rms_deg", "tracking, rms", "deg"),
    Measure("tracking_peak_deg", "tracking, peak", "deg"),
    Measure("device_work_share", "work of the device", "-"),
    Measure("patient_work_share", "work of the patient", "-"),
    Measure("peak_tension_N", "peak tension", "N"),
    Measure("peak_reaction_N", "peak elbow reaction", "N"),
    Measure("smoothness_sparc", "smoothness (SPARC)", "-"),
    Measure("unsafe", "unsafe episodes", "-", rate=True),
)


@dataclass
class Record:
    """Readings of an episode, one a control time."""

    repetition: Repetition
    period: float
    """Control period [s]."""
    readings: list[dict[str, float]] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    event: str | None = None

    def add(self, readings: dict[str, float]) -> None:
        """The readings of a control time."""
        self.readings.append({name: readings[name] for name in READ})

    def column(self, name: str) -> np.ndarray:
        """A reading over time, shape (n,)."""
        return np.array([r[name] for r in self.readings])


READ = (
    "time", "tracking_error", "elbow_angle.rate", "exo_angle.rate", "muscle_moment", "exo_moment", "agonist_tension",
    "antagonist_tension", "elbow_reaction",
)  # fmt: skip


def measured(record: Record) -> dict[str, Any]:
    """Every measure of an episode, by name; one that cannot be had is NaN."""
    error = np.degrees(record.column("tracking_error"))
    times, rate = record.column("time"), record.column("elbow_angle.rate")
    patient = positive_work(times, record.column("muscle_moment") * rate)
    device = positive_work(times, record.column("exo_moment") * record.column("exo_angle.rate"))
    both = patient + device
    tension = max(record.column("agonist_tension").max(), record.column("antagonist_tension").max())
    return {
        "return": math.fsum(record.rewards),
        "tracking_rms_deg": float(np.sqrt(np.mean(error**2))),
        "tracking_peak_deg": float(np.abs(error).max()),
        "device_work_share": device / both if both > 0.0 else math.nan,
        "patient_work_share": patient / both if both > 0.0 else math.nan,
        "peak_tension_N": float(tension),
        "peak_reaction_N": float(record.column("elbow_reaction").max()),
        "smoothness_sparc": smoothness(record.repetition, times, rate, record.period),
        "unsafe": float(record.event is not None),
    }


def positive_work(times: np.ndarray, power: np.ndarray) -> float:
    """Integral of the positive part of a power [W] over time [s] by the trapezoidal rule [J]."""
    return float(np.trapezoid(np.maximum(power, 0.0), times))


def smoothness(repetition: Repetition, times: np.ndarray, rate: np.ndarray, period: float) -> float:
    """Mean SPARC of lifts and returns, each with the rest behind it, in which a late arm still arrives.

    Args:
        repetition: says when the moves are, and how often.
        times: [s], shape (n,).
        rate: of the elbow [rad/s], shape (n,).
        period: between two times [s].
    """
    lifts = repetition.rest + repetition.interval * np.arange(repetition.count)
    backs = lifts + repetition.duration + repetition.pause
    edges = [*np.stack([lifts, backs], axis=1).flat, math.inf]
    parts = [rate[(times >= a) & (times < b)] for a, b in pairwise(edges)]
    found = [sparc(np.abs(part), 1.0 / period) for part in parts]
    return float(np.mean([x for x in found if math.isfinite(x)])) if np.isfinite(found).any() else math.nan


def sparc(speed: np.ndarray, frequency: float) -> float:
    """Spectral arc length of a speed profile (Balasubramanian, Melendez-Calderon, Roby-Brami and Burdet 2015) [-].

    Minus the length of the curve of the speed's amplitude spectrum, frequency and amplitude both scaled to 1, up to the
    last frequency below 10 Hz whose amplitude is 5 % of that at 0 Hz. The closer to 0, the smoother; a minimum-jerk
    reach has -1.41. NaN where there is no movement or too little of it.

    Args:
        speed: shape (n,).
        frequency: of its samples [Hz].
    """
    if speed.size < FEWEST_SAMPLES or not speed.any():
        return math.nan
    length = 2 ** (math.ceil(math.log2(speed.size)) + SPARC_PADDING)
    amplitude = np.abs(np.fft.rfft(speed, length))
    amplitude /= amplitude[0]
    f = np.arange(amplitude.size) * frequency / length
    amplitude, f = amplitude[f <= SPARC_CUTOFF], f[f <= SPARC_CUTOFF]
    last = np.flatnonzero(amplitude >= SPARC_THRESHOLD)[-1] + 1
    amplitude, f = amplitude[:last], f[:last]
    if last < 2:
        return 0.0
    return -float(np.sum(np.hypot(np.diff(f) / (f[-1] - f[0]), np.diff(amplitude))))

"""What is measured of an episode, from the environment's readings without noise at control times.

Work is mechanical and positive: of each party, the integral of the positive part of its moment times the joint's rate.
Shares are of the sum of both, so that a party which brakes the other earns nothing. An episode that an event cuts short
is measured up to its end.

Some measures need readings that not every environment has, and smoothness a movement of lifts and returns; where one
is missing, the measure is left out. Return, reward terms, unsafe episodes, solver failures and length are always there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from exo_env.tasks.movements.repetition import Repetition

SPARC_CUTOFF, SPARC_THRESHOLD, SPARC_PADDING = 10.0, 0.05, 4
"""Largest frequency [Hz], least amplitude [-], doublings of the transform's length (Balasubramanian et al. 2015)."""
FEWEST_SAMPLES = 8
"""Samples that a speed profile needs at least for a smoothness."""
REWARD = "reward."
"""Before the name of a reward term."""
REPETITIONS = "repetitions"
"""Name among what a measure needs for a movement of lifts and returns, which is no reading."""
TENSION = "tension"
"""Name of the largest tension of all ropes of the device [N], which `Record` takes of their readings."""


@dataclass
class Record:
    """Readings of an episode, one a control time."""

    repetition: Repetition | None
    """The movement, None where it is no repetition."""
    tensions: tuple[str, ...]
    """Name of the tension's reading of each rope of the device."""
    period: float
    """Control period [s]."""
    readings: list[dict[str, float]] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    terms: dict[str, float] = field(default_factory=dict)
    """Sum of each reward term times its weight."""
    event: str | None = None
    solver_failed: bool = False

    def add(self, readings: Mapping[str, float]) -> None:
        """The readings of a control time."""
        kept = {name: readings[name] for name in READ if name in readings}
        if self.tensions and all(name in readings for name in self.tensions):
            kept[TENSION] = max(readings[name] for name in self.tensions)
        self.readings.append(kept)

    def add_step(self, reward: float, info: Mapping[str, Any]) -> None:
        """What a step gave."""
        self.rewards.append(float(reward))
        weights = info.get("reward_weights", {})
        for name, value in info.get("reward_terms", {}).items():
            self.terms[name] = self.terms.get(name, 0.0) + float(value) * float(weights.get(name, 1.0))
        self.solver_failed |= bool(info.get("solver_failed", False))

    def column(self, name: str) -> np.ndarray:
        """A reading over time, shape (n,)."""
        return np.array([r[name] for r in self.readings])

    def lacks(self, reads: Iterable[str]) -> list[str]:
        """Which of some readings the environment does not have; REPETITIONS where its movement is another one."""
        here = {*(self.readings[0] if self.readings else ()), *([] if self.repetition is None else [REPETITIONS])}
        return [name for name in reads if name not in here]


@dataclass(frozen=True)
class Measure:
    """A column of the results."""

    name: str
    label: str
    unit: str
    of: Callable[[Record], float]
    """Its number for an episode, NaN where it cannot be had."""
    reads: tuple[str, ...] = ()
    """Readings that it needs, TENSION and REPETITIONS among them."""
    rate: bool = False
    """The numbers are 0 or 1, whose mean says how many; their interquartile mean would hide the few."""
    special: bool = False
    """Only some tasks have it: where it is missing, nothing is left out."""


def _tracking_rms(record: Record) -> float:
    return float(np.sqrt(np.mean(np.degrees(record.column("tracking_error")) ** 2)))


def _tracking_peak(record: Record) -> float:
    return float(np.abs(np.degrees(record.column("tracking_error"))).max())


def _shares(record: Record) -> tuple[float, float]:
    """Shares of device and patient in the positive work."""
    times = record.column("time")
    patient = positive_work(times, record.column("muscle_moment") * record.column("elbow_angle.rate"))
    device = positive_work(times, record.column("exo_moment") * record.column("exo_angle.rate"))
    both = patient + device
    return (device / both, patient / both) if both > 0.0 else (math.nan, math.nan)


def _smoothness(record: Record) -> float:
    assert record.repetition is not None
    return smoothness(record.repetition, record.column("time"), record.column("elbow_angle.rate"), record.period)


WORK = ("time", "muscle_moment", "elbow_angle.rate", "exo_moment", "exo_angle.rate")
MEASURES = (
    Measure("return", "return", "-", lambda r: math.fsum(r.rewards)),
    Measure("tracking_rms_deg", "tracking, rms", "deg", _tracking_rms, ("tracking_error",)),
    Measure("tracking_peak_deg", "tracking, peak", "deg", _tracking_peak, ("tracking_error",)),
    Measure("device_work_share", "work of the device, share", "-", lambda r: _shares(r)[0], WORK),
    Measure("patient_work_share", "work of the patient, share", "-", lambda r: _shares(r)[1], WORK),
    Measure("peak_tension_N", "peak tension", "N", lambda r: float(r.column(TENSION).max()), (TENSION,)),
    Measure(
        "peak_reaction_N", "peak elbow reaction", "N", lambda r: float(r.column("elbow_reaction").max()),
        ("elbow_reaction",),
    ),
    Measure("smoothness_sparc", "smoothness (SPARC)", "-", _smoothness, ("time", "elbow_angle.rate", REPETITIONS)),
    Measure(
        "opposing_power_W", "power against the patient", "W", lambda r: float(r.column("opposing_power").mean()),
        ("opposing_power",), special=True,
    ),
    Measure("unsafe", "unsafe episodes", "-", lambda r: float(r.event is not None), rate=True),
    Measure("solver_failures", "solver failures", "-", lambda r: float(r.solver_failed), rate=True),
    Measure("length_s", "length of the episode", "s", lambda r: len(r.rewards) * r.period),
)  # fmt: skip
READ = tuple(dict.fromkeys(name for m in MEASURES for name in m.reads if name not in (TENSION, REPETITIONS)))
"""Readings that are kept as they are."""


def measured(record: Record) -> dict[str, float]:
    """Every measure of an episode whose readings there are, by name; one that cannot be had is NaN."""
    numbers = {m.name: m.of(record) for m in MEASURES if not record.lacks(m.reads)}
    return numbers | {f"{REWARD}{name}": value for name, value in record.terms.items()}


def left_out(record: Record) -> dict[str, list[str]]:
    """Measures that an environment does not allow, with the readings that it lacks."""
    return {m.name: lacking for m in MEASURES if not m.special and (lacking := record.lacks(m.reads))}


def measures_among(names: Iterable[str]) -> list[Measure]:
    """The measures of some names, in order: those of MEASURES, then the reward terms."""
    known = list(names)
    terms = [name for name in known if name.startswith(REWARD)]
    return [m for m in MEASURES if m.name in known] + [
        Measure(name, f"reward of {name.removeprefix(REWARD)}", "-", lambda r: math.nan) for name in terms
    ]


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
    values = [sparc(np.abs(part), 1.0 / period) for part in parts]
    return float(np.mean([x for x in values if math.isfinite(x)])) if np.isfinite(values).any() else math.nan


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

"""Readings and channels: what a task knows of a world, and what of it an observer is shown.

A reading is one or several true numbers under a name: copied from sensors of the model, taken from a trait of the
patient, or put there by the task's kernel; or it is what the device's own filter estimates. A channel shows a reading:
in a scale, within a range, through an imperfection. Channels stand in groups, and any number of them may show the same
reading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from pydantic import Field

from exo_env.patient.patient import SHOWN, Patient
from exo_env.settings import Settings
from exo_env.traits import range_of, unit_of

ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")


@dataclass(frozen=True)
class Parts:
    """Names of what an ecosystem and a drive have; whatever has a number a part has it in this order."""

    muscles: tuple[str, ...]
    ropes: tuple[str, ...]
    actions: tuple[str, ...]

    @property
    def action_labels(self) -> tuple[str, ...]:
        """Labels of the components of an action."""
        return tuple(ORDINALS[k] if k < len(ORDINALS) else f"number {k + 1}" for k in range(len(self.actions)))


@dataclass(frozen=True)
class Reading:
    """One or several true numbers under a name."""

    name: str
    unit: str
    labels: tuple[str, ...] = ("",)
    """One label for each component."""
    sensors: tuple[str, ...] = ()
    """Components of the model's sensors that are copied, one for each component; none: the task's kernel fills it."""
    trait: str | None = None
    """Name of the patient's trait that the reading is, None where it is none."""
    estimate: str | None = None
    """Name of the estimate of the device's filter that the reading is (estimates.py), None where it is none."""


class Imperfection(Settings):
    """Noise, bias, delay and quantum that separate a channel from the truth."""

    deviation: float = Field(default=0.0, ge=0.0, description="standard deviation of white noise [unit of the channel]")
    bias: float = Field(default=0.0, description="constant that is added to the truth [unit of the channel]")
    delay: float = Field(default=0.0, ge=0.0, le=0.5, description="[s]; linear between two control periods")
    quantum: float = Field(default=0.0, ge=0.0, description="smallest step [unit of the channel]; 0: none")


@dataclass(frozen=True)
class Channel:
    """How a reading is shown to an agent."""

    name: str
    scale: float
    """Value in the reading's unit that is shown as 1."""
    low: float
    """Least value that is shown [unit of the reading]."""
    high: float
    """Greatest value that is shown [unit of the reading]."""
    imperfection: Imperfection = Imperfection()
    """Imperfection that the channel has unless the user gives another."""
    reading: str | None = None
    """Name of the reading; None: that of the channel."""

    @property
    def source(self) -> str:
        """Name of the reading that is shown."""
        return self.reading or self.name


@dataclass(frozen=True)
class Slice:
    """Where a channel stands in the observation."""

    group: str
    name: str
    labels: tuple[str, ...]
    start: int
    stop: int
    unit: str
    scale: float
    """Value in `unit` that is shown as 1."""
    low: float
    """Least value shown [unit]."""
    high: float
    """Greatest value shown [unit]."""

    def as_dict(self) -> dict[str, Any]:
        """The fields as a dict, for JSON."""
        return asdict(self)


def first_places(readings: Sequence[Reading]) -> np.ndarray:
    """Place of the first component of each reading, and behind the last the number of all, shape (n + 1,)."""
    return np.concatenate([[0], np.cumsum([len(r.labels) for r in readings])]).astype(np.int64)


def trait_readings() -> list[Reading]:
    """A reading for each trait that a privileged observer is shown."""
    return [Reading(name, unit_of(Patient, name), trait=name) for name in SHOWN]


def trait_channels() -> list[Channel]:
    """A channel for each of these, over the range that `Patient` accepts; the greatest value is shown as 1."""
    ranges = {name: range_of(Patient, name) for name in SHOWN}
    return [Channel(name, high, low, high) for name, (low, high) in ranges.items()]

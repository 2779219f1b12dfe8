"""What a filter is told beside the model: noise of sensors and motion, what is estimated with the state, bounds.

All numbers are in SI units. A standard deviation is that of one reading, of the start, or, for noise that drives the
motion, per square root of a second.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.errors import InputError
from dms_core.files.yaml_text import read_yaml, said_of
from dms_core.validation import Checked

Positive = Annotated[float, Field(gt=0.0)]
AtLeast0 = Annotated[float, Field(ge=0.0)]


class Bias(Checked):
    """A channel's offset, which is estimated."""

    deviation: Positive = Field(description="at the start [unit of the channel]")
    walk: AtLeast0 = Field(default=0.0, description="per square root of a second [unit of the channel / sqrt s]")


class Channel(Checked):
    """How a sensor component is measured."""

    deviation: Positive = Field(description="of white noise [unit of the channel]")
    quantum: AtLeast0 = Field(default=0.0, description="smallest step [unit of the channel]; adds quantum^2 / 12")
    delay: AtLeast0 = Field(default=0.0, description="of the reading behind what it tells of [s]")
    bias: Bias | None = Field(default=None, description="offset to estimate; default: none")

    @property
    def variance(self) -> float:
        """Of one reading, that of its quantum included."""
        return self.deviation**2 + self.quantum**2 / 12.0


class EstimatedInput(Checked):
    """An input that is not known: Gauss-Markov about its declared value, or a random walk.

    It is held over a period. With a time constant T, u - m falls as exp(-t / T) and wanders with the deviation that it
    has in the long run; a walk wanders off by `walk` in a second.
    """

    deviation: Positive = Field(
        description="at the start, and with a time constant in the long run [unit of the input]"
    )
    time_constant: Positive | None = Field(default=None, description="[s]; default: a random walk")
    walk: Positive | None = Field(default=None, description="of a random walk [unit of the input / sqrt s]")

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.time_constant is None) == (self.walk is None):
            raise ValueError("expected either time_constant or walk")
        return self

    def over(self, dt: float) -> tuple[float, float]:
        """Factor of u - m over a time, and the variance that joins [s]."""
        if self.time_constant is None:
            assert self.walk is not None
            return 1.0, self.walk**2 * dt
        kept = math.exp(-dt / self.time_constant)
        return kept, self.deviation**2 * (1.0 - kept**2)


class EstimatedConstant(Checked):
    """A declared number that is not known, such as a mass; it begins at its declared value."""

    deviation: Positive = Field(description="at the start [unit of the number]")
    walk: AtLeast0 = Field(default=0.0, description="per square root of a second [unit of the number / sqrt s]")


class MotionNoise(Checked):
    """White noise that drives the motion; that of a named coordinate replaces the common one."""

    acceleration: AtLeast0 = Field(default=0.0, description="of coordinates of second order [unit / s^2 / sqrt Hz]")
    rate: AtLeast0 = Field(default=0.0, description="of states of first order [unit / s / sqrt Hz]")
    coordinates: dict[str, AtLeast0] = Field(default={}, description="of single coordinates, by name")


class InitialDeviations(Checked):
    """How well the start is known; what is given for a coordinate replaces the common number."""

    position: Positive = Field(default=0.1, description="of coordinates of second order [m or -]")
    velocity: Positive = Field(default=1.0, description="of their rates [m/s or 1/s]")
    state: Positive = Field(default=0.1, description="of states of first order [their unit]")
    coordinates: dict[str, Positive] = Field(default={}, description="of q.<name> and v.<name>, by these names")
    covariance: tuple[tuple[float, ...], ...] | None = Field(
        default=None, description="whole matrix, in the order of the estimated names; replaces all deviations"
    )


class FilterSettings(Checked):
    """Settings of a filter; `from_file` reads them from YAML."""

    period: Positive = Field(default=0.01, description="longest time between two predictions [s]")
    steps: int = Field(default=1, ge=1, le=1000, description="implicit steps of a period")
    form: Literal["extended", "iterated", "unscented"] = Field(default="extended", description="form of the filter")
    channels: dict[str, Channel] = Field(min_length=1, description="measured sensor components, by name")
    inputs: dict[str, EstimatedInput] = Field(default={}, description="inputs to estimate, by name")
    constants: dict[str, EstimatedConstant] = Field(
        default={}, description="declared numbers to estimate, by '<element>.<key>'"
    )
    noise: MotionNoise = Field(default_factory=MotionNoise)
    initial: InitialDeviations = Field(default_factory=InitialDeviations)
    bounds: dict[str, tuple[float | None, float | None]] = Field(
        default={}, description="least and largest value of a state of first order or an input, by name"
    )

    @model_validator(mode="after")
    def _bounds_leave_room(self) -> Self:
        for name, (low, high) in self.bounds.items():
            if low is not None and high is not None and not low < high:
                raise ValueError(f"bounds.{name}: expected the least value below the largest, got {low} and {high}")
        return self

    @classmethod
    def from_file(cls, path: str | Path) -> Self:
        """These settings from a YAML file.

        Raises:
            InputError: the file is missing or wrong; names file, key and value.
        """
        with said_of(path):
            return cls(**read_yaml(path))


ASYMMETRY = 1e-9
"""Difference of two mirrored entries, over their size, up to which a matrix counts as symmetric."""


def checked_covariance(what: str, names: tuple[str, ...], matrix: np.ndarray) -> np.ndarray:
    """A symmetric positive definite matrix, or a refusal that names the entry.

    Args:
        what: the matrix, for the message.
        names: of its rows, n of them.
        matrix: shape (n, n).

    Raises:
        InputError: it has another shape, is not finite, not symmetric, or not positive definite.
    """
    P = np.asarray(matrix, float)
    n = len(names)
    if P.shape != (n, n):
        raise InputError(f"{what}: Expected {n} x {n} numbers, for {', '.join(names)}, got shape {P.shape}.")
    if not np.isfinite(P).all():
        i, j = np.argwhere(~np.isfinite(P))[0]
        raise InputError(f"{what}: Expected finite numbers, got {P[i, j]} between '{names[i]}' and '{names[j]}'.")
    size = np.sqrt(np.outer(np.abs(np.diag(P)), np.abs(np.diag(P)))) + np.abs(P)
    wrong = np.argwhere(np.abs(P - P.T) > ASYMMETRY * size)
    if len(wrong):
        i, j = wrong[0]
        raise InputError(
            f"{what}: Expected a symmetric matrix, got {P[i, j]:.6g} between '{names[i]}' and '{names[j]}' and "
            f"{P[j, i]:.6g} the other way round."
        )
    for k in range(1, n + 1):
        try:
            np.linalg.cholesky(P[:k, :k])
        except np.linalg.LinAlgError:
            raise InputError(
                f"{what}: Expected a positive definite matrix; with the entry of '{names[k - 1]}' (variance "
                f"{P[k - 1, k - 1]:.6g}) it is none: a variance must be above 0 and correlations below 1."
            ) from None
    return P

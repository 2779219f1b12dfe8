"""How one number of a patient is spread over a population.

In a file, one of:

    0.8                                                              that value
    {uniform: [0.3, 0.7]}                                            between two limits
    {normal: {mean: 0.5, deviation: 0.1, low: 0.2, high: 0.8}}       normal, cut off at two limits
    {log_uniform: [0.001, 0.1]}                                      uniform in the logarithm
    {choice: [male, female], weights: [1, 2]}                        one of several; equal weights unless given

A value is the quantile of one uniform number from 0 to 1, which each field takes from a stream of its own (streams.py),
so that a field's spread changes no other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import Field, model_validator
from scipy.special import ndtr, ndtri

from dms_core.compiled.jit import compiled
from dms_core.errors import InputError, choices
from dms_core.validation import shown
from exo_env.settings import Settings
from exo_env.streams import normal_quantile, streams, uniforms

Value = float | str


class Constant(Settings):
    """The same value for all."""

    constant: Value

    def limits(self) -> tuple[Value, ...]:
        """Every value, or the least and the greatest."""
        return (self.constant,)

    def quantile(self, _: float) -> Value:
        """The value, whatever the probability."""
        return self.constant


class Uniform(Settings):
    """Uniform between two limits."""

    uniform: tuple[float, float] = Field(description="least and greatest value")

    @model_validator(mode="after")
    def _ordered(self):
        if self.uniform[0] > self.uniform[1]:
            raise ValueError(f"uniform = {list(self.uniform)}: the first limit must not be above the second")
        return self

    def limits(self) -> tuple[Value, ...]:
        """The least and the greatest value."""
        return self.uniform

    def quantile(self, p: float) -> Value:
        """Value at a probability."""
        low, high = self.uniform
        return low + p * (high - low)


class LogUniform(Settings):
    """Uniform in the logarithm between two positive limits."""

    log_uniform: tuple[float, float] = Field(description="least and greatest value, above 0")

    @model_validator(mode="after")
    def _ordered(self):
        low, high = self.log_uniform
        if not 0.0 < low <= high:
            raise ValueError(f"log_uniform = {[low, high]}: expected two numbers above 0 in rising order")
        return self

    def limits(self) -> tuple[Value, ...]:
        """The least and the greatest value."""
        return self.log_uniform

    def quantile(self, p: float) -> Value:
        """Value at a probability; rounding does not leave the limits."""
        low, high = self.log_uniform
        return min(max(low * math.exp(p * math.log(high / low)), low), high)


class Truncated(Settings):
    """Numbers of a normal distribution that is cut off at two limits."""

    mean: float = Field(description="of the distribution before it is cut")
    deviation: float = Field(gt=0.0, description="standard deviation before it is cut")
    low: float
    high: float

    @model_validator(mode="after")
    def _ordered(self):
        if not self.low < self.high:
            raise ValueError(f"low = {self.low} and high = {self.high}: low must be below high")
        if self.mean + 5.0 * self.deviation < self.low or self.mean - 5.0 * self.deviation > self.high:
            raise ValueError(f"mean = {self.mean} is more than five deviations outside of {self.low} to {self.high}")
        return self


class Normal(Settings):
    """Normal, cut off at two limits."""

    normal: Truncated

    def limits(self) -> tuple[Value, ...]:
        """The least and the greatest value."""
        return (self.normal.low, self.normal.high)

    def quantile(self, p: float) -> Value:
        """Value at a probability."""
        n = self.normal
        low, high = ndtr((n.low - n.mean) / n.deviation), ndtr((n.high - n.mean) / n.deviation)
        return min(max(n.mean + n.deviation * float(ndtri(low + p * (high - low))), n.low), n.high)


class Choice(Settings):
    """One of several values."""

    choice: tuple[Value, ...] = Field(min_length=1, max_length=1000)
    weights: tuple[float, ...] | None = Field(default=None, description="relative, one for each; None: equal")

    @model_validator(mode="after")
    def _weighted(self):
        w = self.weights
        if w is not None and (len(w) != len(self.choice) or min(w) < 0.0 or not 0.0 < sum(w) < math.inf):
            raise ValueError(
                f"weights = {shown(list(w))}: expected one number from 0 for each of {shown(list(self.choice))}, "
                "not all 0"
            )
        return self

    def limits(self) -> tuple[Value, ...]:
        """Every value; numbers in rising order."""
        numbers = [x for x in self.choice if not isinstance(x, str)]
        return tuple(sorted(numbers)) if len(numbers) == len(self.choice) else self.choice

    def quantile(self, p: float) -> Value:
        """Value at a probability."""
        return self.choice[weighted(self.weights or (1.0,) * len(self.choice), p)]


Distribution = Constant | Uniform | LogUniform | Normal | Choice
KINDS: dict[str, type[Distribution]] = {
    "uniform": Uniform, "log_uniform": LogUniform, "normal": Normal, "choice": Choice,
}  # fmt: skip


def weighted(weights: tuple[float, ...], p: float) -> int:
    """Number of the interval in which a probability falls, the intervals being in proportion to the weights."""
    total, reached = sum(weights), 0.0
    for k, w in enumerate(weights):
        reached += w
        if p * total < reached:
            return k
    return max(k for k, w in enumerate(weights) if w > 0.0)


def distribution(spec: Any) -> Distribution:
    """A distribution from what stands in a file.

    Raises:
        InputError: it is none; says what would be.
    """
    if isinstance(spec, str) or (isinstance(spec, int | float) and not isinstance(spec, bool)):
        return Constant(constant=spec)
    if isinstance(spec, dict):
        for kind, cls in KINDS.items():
            if kind in spec and all(isinstance(key, str) for key in spec):
                return cls(**spec)
    raise InputError(f"expected a value or a distribution ({choices(KINDS)}), got {shown(spec)}.")


STRAIGHT, LOGARITHMIC, NORMAL, OTHER = range(4)
"""How a row of `Draws` gives a quantile."""
LEAST, MOST = 1e-300, 1.0 - 2.0**-53
"""Probabilities beyond which a normal quantile is not finite."""


class Draws:
    """Several distributions of numbers, each drawn from a stream of its own.

    Args:
        spreads: distribution of each number, by the name of its stream (streams.py).
    """

    def __init__(self, spreads: Mapping[str, Distribution]) -> None:
        rows = [_drawing(d) for d in spreads.values()]
        self._streams = streams(spreads)
        self._kinds = np.array([kind for kind, _ in rows], np.int64)
        self._numbers = np.array([numbers for _, numbers in rows], dtype=float).reshape(-1, 6)
        self._others = [(k, d) for k, d in enumerate(spreads.values()) if rows[k][0] == OTHER]

    def sample(self, key: np.uint64) -> np.ndarray:
        """One number of each in the episode of a key, shape (n,)."""
        x = np.empty(len(self._kinds))
        uniforms(key, self._streams, x)
        others = [(k, d.quantile(float(x[k]))) for k, d in self._others]
        _quantiles(self._kinds, self._numbers, x)
        for k, value in others:
            x[k] = value
        return x


def _drawing(d: Distribution) -> tuple[int, tuple[float, ...]]:
    """Kind of a distribution, and the numbers that `_quantiles` reads."""
    if isinstance(d, Constant) and not isinstance(d.constant, str):
        return STRAIGHT, (d.constant, d.constant, 0.0, 0.0, 0.0, 0.0)
    if isinstance(d, Uniform):
        return STRAIGHT, (*d.uniform, 0.0, 0.0, 0.0, 0.0)
    if isinstance(d, LogUniform):
        low, high = d.log_uniform
        return LOGARITHMIC, (low, high, math.log(high / low), 0.0, 0.0, 0.0)
    if isinstance(d, Normal):
        n = d.normal
        low, high = (float(ndtr((x - n.mean) / n.deviation)) for x in (n.low, n.high))
        return NORMAL, (n.low, n.high, n.mean, n.deviation, low, high - low)
    return OTHER, (0.0,) * 6


@compiled
def _quantiles(kinds, numbers, x):
    """Probabilities in x become values; rounding does not leave the limits."""
    for k in range(x.shape[0]):
        low, high = numbers[k, 0], numbers[k, 1]
        if kinds[k] == STRAIGHT:
            x[k] = low + x[k] * (high - low)
        elif kinds[k] == LOGARITHMIC:
            x[k] = min(max(low * math.exp(x[k] * numbers[k, 2]), low), high)
        elif kinds[k] == NORMAL:
            p = min(max(numbers[k, 4] + x[k] * numbers[k, 5], LEAST), MOST)
            x[k] = min(max(numbers[k, 2] + numbers[k, 3] * normal_quantile(p), low), high)

"""Inputs u(t) and references psi(t): value, first and second derivative at any time (paper eq. 4).

A signal is a row of polynomial pieces, a harmonic, or a compiled function of the user. The integrator ends a step
on every time of `jumps` and starts afresh behind it.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator
from scipy.interpolate import CubicSpline

from dms_core.model.element import Declaration
from dms_core.validation import Checked

DEGREE = 5
"""Highest degree of a polynomial piece: a minimum-jerk movement is a quintic (Flash and Hogan 1985)."""


class Pieces(NamedTuple):
    """sum_k c[i, k] (t - t[i])^k on [t[i], t[i+1]); the first and last piece extend to all times."""

    t: np.ndarray
    """Starts of the pieces [s], shape (n,)."""
    c: np.ndarray
    """Coefficients, lowest power first, shape (n, DEGREE + 1)."""
    jumps: np.ndarray
    """Times at which value or slope is discontinuous [s]."""


def _pieces(t, columns, jumps=()) -> Pieces:
    c = np.zeros((len(t), DEGREE + 1))
    for k, column in enumerate(columns):
        c[:, k] = column
    return Pieces(np.asarray(t, float), c, np.asarray(jumps, float))


class Signal(Checked):
    """Base of every signal."""

    def pieces(self) -> Pieces:
        """The polynomial pieces that represent this signal."""
        raise NotImplementedError


class Constant(Signal):
    """The same value at all times; also the form of an input that is set between calls."""

    kind: Literal["constant"] = "constant"
    value: float = Field(default=0.0, description="value [unit of the input]")

    def pieces(self) -> Pieces:
        """One piece of degree 0."""
        return _pieces([0.0], [[self.value]])


class _Table(Signal):
    times: tuple[float, ...] = Field(min_length=1, description="increasing times [s]")
    values: tuple[float, ...] = Field(description="one value a time [unit of the input]")

    @model_validator(mode="after")
    def _matching(self):
        if len(self.times) != len(self.values):
            raise ValueError(f"{len(self.times)} times but {len(self.values)} values; give one value for each time")
        if np.any(np.diff(self.times) <= 0.0):
            k = int(np.argmax(np.diff(self.times) <= 0.0))
            raise ValueError(f"times must increase; times[{k}] = {self.times[k]}, times[{k + 1}] = {self.times[k + 1]}")
        return self


class Steps(_Table):
    """Piecewise constant: each value holds from its time to the next. Steps of the solver land on the jumps."""

    kind: Literal["steps"] = "steps"

    def pieces(self) -> Pieces:
        """Pieces of degree 0."""
        return _pieces(self.times, [self.values], self.times[1:])


class Lines(_Table):
    """Piecewise linear between the given points, constant outside; the solver lands on the kinks."""

    kind: Literal["lines"] = "lines"

    def pieces(self) -> Pieces:
        """Pieces of degree 1."""
        t, x = np.asarray(self.times), np.asarray(self.values)
        slopes = np.append(np.diff(x) / np.diff(t), 0.0)
        return _pieces(np.append(t[0] - 1.0, t), [np.append(x[0], x), np.append(0.0, slopes)], t)


class Spline(_Table):
    """Cubic spline through the given points, clamped (zero slope) and constant outside: C2 inside, C1 at the ends."""

    kind: Literal["spline"] = "spline"

    def pieces(self) -> Pieces:
        """Pieces of degree 3."""
        t, x = np.asarray(self.times), np.asarray(self.values)
        if len(t) < 2:
            return Constant(value=float(x[0])).pieces()
        c = CubicSpline(t, x, bc_type="clamped").c[::-1]
        pad = lambda row, last: np.concatenate([[row[0] if last else 0.0], row, [x[-1] if last else 0.0]])  # noqa: E731
        columns = [np.concatenate([[x[0]], c[0], [x[-1]]])] + [pad(c[k], False) for k in (1, 2, 3)]
        return _pieces(np.concatenate([[t[0] - 1.0], t]), columns)


class MinimumJerk(_Table):
    """Through the given points with minimum-jerk moves (Flash and Hogan 1985): each a quintic with zero end rates.

    Equal neighbours make a pause. C2 everywhere.
    """

    kind: Literal["minimum_jerk"] = "minimum_jerk"

    def pieces(self) -> Pieces:
        """Quintic pieces x0 + d (10 s^3 - 15 s^4 + 6 s^5), s = (t - t0) / T."""
        t, x = np.array(self.times), np.array(self.values)
        T, d = t[1:] - t[:-1], x[1:] - x[:-1]
        # A piece of rest before the first point and one behind the last.
        c = np.zeros((len(t) + 1, DEGREE + 1))
        c[0, 0], c[1:, 0] = x[0], x
        c[1:-1, 3], c[1:-1, 4], c[1:-1, 5] = 10 * d / T**3, -15 * d / T**4, 6 * d / T**5
        return Pieces(np.concatenate([[t[0] - 1.0], t]), c, np.zeros(0))


class Harmonic(Signal):
    """offset + amplitude sin(2 pi frequency t + phase)."""

    kind: Literal["harmonic"] = "harmonic"
    amplitude: float = Field(description="amplitude [unit of the input]")
    frequency: float = Field(gt=0.0, description="frequency [Hz]")
    phase: float = Field(default=0.0, description="phase [rad]")
    offset: float = Field(default=0.0, description="mean value [unit of the input]")


class Function(Signal):
    """A Python function of time that numba can compile: f(t) -> (value, rate, second derivative).

    Compiled once to machine code; what it closes over is frozen then.
    """

    kind: Literal["function"] = "function"
    function: Any = Field(description="f(t [s]) -> (value, first, second time derivative)")
    jumps: tuple[float, ...] = Field(default=(), description="times of discontinuities [s]")


AnySignal = Annotated[
    Constant | Steps | Lines | Spline | MinimumJerk | Harmonic | Function, Field(discriminator="kind")
]


class Input(Declaration):
    """A named input u_k(t) of the system."""

    kind: ClassVar[str] = "input"
    signal: AnySignal = Field(default=Constant(), description="course in time")

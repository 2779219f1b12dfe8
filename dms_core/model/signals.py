"""Inputs u(t) and references psi(t): value, first and second derivative at any time (paper eq. 4).

A signal is a row of polynomial pieces, a harmonic, or a compiled function of the user. The integrator ends a step
on every time of `jumps` and starts afresh behind it.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, PrivateAttr, model_validator
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from dms_core.files.csv_table import check_times, read_table, unit_factor
from dms_core.model.element import Declaration
from dms_core.model.smoothing import low_pass
from dms_core.validation import Checked

DEGREE = 5
"""Highest degree of a polynomial piece: a minimum-jerk movement is a quintic (Flash and Hogan 1985)."""
SPLINES = {"lines": 1, "cubic": 3, "quintic": 5}
"""Degree of the pieces between the rows of a table."""


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


class _Recorded(Signal):
    """Values at many times, joined and perhaps filtered."""

    interpolation: Literal["lines", "cubic", "quintic"] = Field(default="lines", description="between the rows")
    cutoff: float | None = Field(
        default=None,
        gt=0.0,
        description="cut-off of a low-pass filter [Hz]: Butterworth of order 2, both ways; default: no filter",
    )

    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and values, as recorded."""
        raise NotImplementedError

    def what(self) -> str:
        """Whose values they are, for errors."""
        return f"'{self.kind}'"  # type: ignore[attr-defined]

    @model_validator(mode="after")
    def _enough(self):
        t, x = self.rows()
        least = SPLINES[self.interpolation] + 1
        if len(t) < least:
            raise ValueError(
                f"{self.what()}: Expected at least {least} rows for interpolation '{self.interpolation}', got {len(t)}"
            )
        if self.cutoff is not None:
            low_pass(t, x, self.cutoff, self.what())
        return self

    def pieces(self) -> Pieces:
        """Pieces of degree 1, 3 or 5 between the rows, constant outside."""
        t, x = self.rows()
        if self.cutoff is not None:
            x = low_pass(t, x, self.cutoff, self.what())
        if self.interpolation == "lines":
            return Lines(times=tuple(t), values=tuple(x)).pieces()
        spline = PPoly.from_spline(make_interp_spline(t, x, k=SPLINES[self.interpolation]))
        inside = np.diff(spline.x) > 0.0
        c = np.zeros((int(inside.sum()) + 2, DEGREE + 1))
        c[0, 0], c[-1, 0] = x[0], x[-1]
        c[1:-1, : len(spline.c)] = spline.c[::-1, inside].T
        return Pieces(np.concatenate([[t[0] - 1.0], spline.x[:-1][inside], [t[-1]]]), c, t[[0, -1]])


class Samples(_Recorded, _Table):
    """Samples of a motion, a load or a command, joined as in a table; constant outside."""

    kind: Literal["samples"] = "samples"

    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Times and values as given."""
        return np.array(self.times), np.array(self.values)


class Table(_Recorded):
    """A column of a CSV file over a column of times: a recorded motion, a measured load, a command. Constant outside.

    A relative file name counts from the folder of the model file. Cells must be finite numbers, and times must rise
    without holes. 'lines' joins the rows by straight lines, and the solver lands on each row; 'cubic' and 'quintic' are
    splines through them, C2 and C4 inside, as what moves a driver must be.
    """

    kind: Literal["table"] = "table"
    file: str = Field(min_length=1, description="CSV file whose first line names the columns")
    column: str = Field(min_length=1, description="column of the values")
    time: str = Field(default="time_s", min_length=1, description="column of the times [s]")
    unit: str | None = Field(
        default=None, description="unit of the values where it is not of SI: deg, mm, cm, ms, kN, percent"
    )
    time_unit: str | None = Field(default=None, description="unit of the times where it is not s: ms")
    longest_gap: float | None = Field(
        default=None, gt=0.0, description="longest interval between rows that is no hole [s]; default: 5 usual ones"
    )
    _rows: tuple[tuple[float, ...], tuple[float, ...]] = PrivateAttr(default=((), ()))

    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """The two columns, read once, in SI units."""
        if not self._rows[0]:
            table = read_table(self.file, (self.time, self.column))
            times = unit_factor(self.file, self.time, self.time_unit) * table.column(self.time)
            values = unit_factor(self.file, self.column, self.unit) * table.column(self.column)
            check_times(table, self.time, times, self.longest_gap)
            self._rows = (tuple(times.tolist()), tuple(values.tolist()))
        return np.array(self._rows[0]), np.array(self._rows[1])

    def what(self) -> str:
        """File and column."""
        return f"table '{self.file}', column '{self.column}'"


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
    Constant | Steps | Lines | Spline | MinimumJerk | Samples | Table | Harmonic | Function, Field(discriminator="kind")
]


class Input(Declaration):
    """A named input u_k(t) of the system."""

    kind: ClassVar[str] = "input"
    signal: AnySignal = Field(default=Constant(), description="course in time")

"""What steers a run: tolerances, step sizes, the method."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any, Literal

from dms_core.errors import InputError, choices
from dms_core.simulation.state import METHOD, Options

MethodName = Literal["bdf2", "sdirk2", "radau5"]
"""A method of integration, see `SolverOptions.method`."""
METHODS = METHOD._fields
MOST_STEPS = 2**62
"""Counts are whole numbers of 64 bits."""


def is_positive(value: Any) -> bool:
    """True for a finite number above 0, of Python or NumPy."""
    number = isinstance(value, Real) and not isinstance(value, bool)
    return number and bool(math.isfinite(value) and value > 0)


@dataclass(frozen=True)
class SolverOptions:
    """How a run is solved. The defaults keep the elbow angle of arm26 within about 4e-5 rad over a second."""

    rtol: float = 1e-5
    """Relative tolerance [-]: the local error of a step is kept below a tenth of atol + rtol |y|.

    The error of a run is larger, by what the motion makes of it. Measured over some turns (docs/digits.md): BDF2 errs
    by 10 to 100 rtol at 1e-5 and 100 to 1000 rtol at 1e-8, as its error falls with rtol^(2/3). Radau IIA, whose
    estimate is coarse, divides both tolerances by rtol^(1/3); it errs by 1 to 100 rtol, falling with rtol^(5/6). A
    motion that drives neighbours apart multiplies both, a double pendulum over 10 s by 10^4.
    """
    atol: float | None = None
    """Absolute tolerance of every variable in its own unit; None takes rtol times each variable's nominal size."""
    fixed_step: float | None = None
    """Constant step [s], but for shorter ones that end on a jump of an input or on the end; None: error control."""
    h_max: float = 0.1
    """Largest step [s]."""
    h_min: float = 1e-12
    """Step below which a run gives up [s]."""
    newton_tol: float = 0.05
    """Largest error left by Newton's method, over the largest local error allowed [-]."""
    constraint_tol: float = 1e-10
    """Largest |phi| left by a step [m or -], and |phi_q v| [m/s or 1/s] (above 1000 / s, 1e-3 c0 times as much)."""
    max_steps: int = 10_000_000
    """Steps after which a run gives up."""
    method: MethodName = "bdf2"
    """'bdf2': of order 2, the paper's. 'sdirk2': of order 2, needs no past: quicker where inputs jump every few steps,
    slower in smooth motion. 'radau5': Radau IIA of order 5, for errors below about 1e-5 of the motion."""

    def __post_init__(self) -> None:
        for name in ("rtol", "h_max", "h_min", "newton_tol", "constraint_tol"):
            value = getattr(self, name)
            if not is_positive(value):
                raise InputError(f"solver option {name}: Expected a positive number, got {value!r}.")
        for name in ("atol", "fixed_step"):
            value = getattr(self, name)
            if value is not None and not is_positive(value):
                raise InputError(f"solver option {name}: Expected a positive number or None, got {value!r}.")
        if not (is_positive(self.max_steps) and self.max_steps == int(self.max_steps) <= MOST_STEPS):
            raise InputError(
                f"solver option max_steps: Expected a positive whole number up to {MOST_STEPS}, got {self.max_steps!r}."
            )
        if self.h_min > self.h_max:
            raise InputError(f"solver option h_min: Expected at most h_max = {self.h_max} s, got {self.h_min} s.")
        if self.method not in METHODS:
            raise InputError(f"solver option method: Expected one of {choices(METHODS)}, got {self.method!r}.")

    def numbers(self) -> Options:
        """The options as compiled code takes them."""
        return Options(
            float(self.rtol), float(self.atol or 0.0), float(self.fixed_step or 0.0), float(self.h_max),
            float(self.h_min), float(self.newton_tol), float(self.constraint_tol), int(self.max_steps),
            METHODS.index(self.method),
        )  # fmt: skip

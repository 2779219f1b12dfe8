"""What a run gives back: a result code with a sentence, statistics, and the trajectory with dense output."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import Enum
from functools import cached_property
from typing import Any

import numpy as np

from dms_core.assembly.model import Model
from dms_core.assembly.tables import Signals
from dms_core.errors import DmsError, InputError, SimulationError, choices
from dms_core.files.memory import check_memory
from dms_core.flags import Flag, Limits, input_values
from dms_core.simulation.dense_output import Rates, cubic, quintic


class Result(Enum):
    """How a run ended; the value is the sentence shown to the user."""

    SUCCESS = "The run reached its end time."
    STEP_TOO_SMALL = "The error test asked for a step below the smallest allowed one; loosen rtol or look for a discontinuity that no input table declares."  # noqa: E501
    NEWTON_FAILED = (
        "Newton's method did not converge at any step size that is allowed: take a smaller fixed step or h_min."
    )
    MATRIX_SINGULAR = "The Newton matrix is singular: the equations determine not everything that moves."
    SINGULAR_POSITION = (
        "The mechanism has come to a singular position: rounding would decide on which branch it goes on. A step that "
        "passes it is a longer one: of a looser rtol, or of the method radau5; otherwise remove the branch, as by "
        "slightly other lengths."
    )
    TOO_MANY_STEPS = "The largest number of steps was used up before the end time; raise max_steps or loosen rtol."
    RATES_FAILED = "No accelerations and multipliers satisfy the equations at a start or jump."
    INTERRUPTED = "The run was interrupted by the user; what was computed before is complete."


@dataclass(frozen=True)
class SolveStats:
    """Counts and worst errors of a run."""

    steps: int
    """Accepted steps."""
    rejected_error: int
    """Steps repeated because the local error was too large."""
    rejected_newton: int
    """Steps repeated because Newton did not converge."""
    newton_iterations: int
    factorisations: int
    restarts: int
    """Starts of the method: one, and one for each jump of an input."""
    largest_phi: float
    """Largest |phi| over all rows and steps, redundant rows included [m or -]."""
    largest_phi_v: float
    """Largest |phi_q v + phi_t| [m/s or 1/s]."""
    largest_mu: float
    """Largest |mu|: zero on an exact solution, a measure of the constraint error made by the method."""
    smallest_step: float
    """[s]"""
    largest_step: float
    """[s]"""

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


class Trajectory:
    """States, multipliers and sensors of a run, on the solver's own steps and at any time between.

    At a jump of an input the time appears twice: values before it, then values behind it.

    Attributes:
        t: solver times [s], shape (n,).
        q, v, a: coordinates, velocities, accelerations at these times, shape (n, n_q).
        lam, mu: multipliers, shape (n, n_phi); unique (least norm) where constraints are redundant.
        result: how the run ended; `message` is its sentence with time and numbers, and those of the flags.
        stats: counts and worst errors.
    """

    def __init__(
        self,
        model: Model,
        signals: Signals,
        record: np.ndarray,
        result: Result,
        stats: SolveStats,
        message: str,
        rates: Rates | None = None,
    ) -> None:
        n, m = model.n_q, model.n_phi
        self.model, self.signals = model, signals
        self.t = record[:, 0].copy()
        self.q, self.v, self.a = (record[:, 1 + k * n : 1 + (k + 1) * n].copy() for k in range(3))
        self._lam = record[:, 1 + 3 * n : 1 + 3 * n + m].copy()
        self.mu = record[:, 1 + 3 * n + m :].copy()
        self.result, self.stats, self._message, self._rates = result, stats, message, rates

    @cached_property
    def flags(self) -> tuple[Flag, ...]:
        """Elements that left the range they are meant for, with when and how far: ropes that push, fibres at an end."""
        limits, behind = Limits(self.model), _behind_jumps(self.t)
        lam = self.lam if limits.reads("multiplier") else self._lam
        reads = limits.reads("input")
        u = input_values(self.model, self.signals, self.t, self.v, behind) if reads else np.zeros((0, 0))
        return limits.left(self.t, self.q, lam, u)

    @cached_property
    def message(self) -> str:
        """How the run ended, and every flag, in sentences."""
        return " ".join([self._message, *(flag.sentence for flag in self.flags)])

    @cached_property
    def _whole_lam(self) -> np.ndarray:
        """Multipliers with those of welded bodies, which a step does not solve for."""
        behind = _behind_jumps(self.t)
        return self.model.whole_multipliers(self.signals, self.t, self.q, self.v, self.a, self._lam, behind)

    @cached_property
    def lam(self) -> np.ndarray:
        """Multipliers, shape (n, n_phi); computed when asked for, as making them unique takes longer than a step."""
        return self.model.unique_multipliers(self.q, self._whole_lam)

    @property
    def success(self) -> bool:
        """True when the end time was reached."""
        return self.result is Result.SUCCESS

    def check(self) -> Trajectory:
        """This trajectory, or SimulationError with the result's sentence when the run failed.

        Raises:
            KeyboardInterrupt: the user stopped it.
        """
        if self.result is Result.INTERRUPTED:
            raise KeyboardInterrupt
        if not self.success:
            raise SimulationError(self.message)
        return self

    def at(self, times: Any) -> States:
        """Dense output: states at any times inside the run; at a jump the value before it.

        q is the cubic through q and v at both ends of a step, v that through v and vdot (for first-order coordinates
        the slope of q), vdot its slope; lam and mu are linear in a step. All are of the order of BDF2 and SDIRK2, 2.
        Behind Radau IIA second-order coordinates are the quintic of dense_output.py, of order 5, and vdot and lam solve
        the equations at its q and v.

        Args:
            times: [s], shape (k,), between the first and the last recorded time.

        Raises:
            DmsError: a time is outside the run.
        """
        times = np.atleast_1d(np.asarray(times, float))
        slack = 1e-12 * max(1.0, abs(self.t[-1]))
        if len(times) and (times.min() < self.t[0] - slack or times.max() > self.t[-1] + slack):
            raise DmsError(
                f"times {times.min():.6g} ... {times.max():.6g} s asked for, but the run covers "
                f"{self.t[0]:.6g} ... {self.t[-1]:.6g} s ({self.result.value})"
            )
        end = np.clip(np.searchsorted(self.t, times, side="left"), 1, len(self.t) - 1)
        start = end - 1
        h = (self.t[end] - self.t[start])[:, None]
        h = np.where(h > 0.0, h, 1.0)
        x = (times - self.t[start])[:, None] / h
        between = lambda values: (1.0 - x) * values[start] + x * values[end]  # noqa: E731
        mu, least = between(self.mu), [c.least for c in self.model.layout.coordinates]
        if self._rates is not None:
            ends = [(y[start], y[end]) for y in (self.q, self.v, self.a)]
            q, v, a = quintic(x, h, ends, self.model.second_order)
            q = np.maximum(q, least)
            v, a, lam = self._rates(self.model, self.signals, times, q, v, a, between(self._lam))
            lam = self.model.whole_multipliers(self.signals, times, q, v, a, lam, np.zeros(len(times), bool))
            return States(self.model, self.signals, times, q, v, a, self.model.unique_multipliers(q, lam), mu)
        second = self.model.second_order
        q, slope_q, _ = cubic(x, h, self.q[start], self.q[end], self.v[start], self.v[end])
        v, slope_v, _ = cubic(x, h, self.v[start], self.v[end], self.a[start], self.a[end])
        unique, whole = self.model.unique_multipliers, self._whole_lam
        lam = (1.0 - x) * unique(self.q[start], whole[start]) + x * unique(self.q[end], whole[end])
        q = np.maximum(q, least)
        v, a = np.where(second, v, slope_q), np.where(second, slope_v, 0.0)
        return States(self.model, self.signals, times, q, v, a, lam, mu)

    def grid(self, sample: float) -> np.ndarray:
        """Times 0, sample, 2 sample, ... of the run, and its end [s].

        Raises:
            InputError: `sample` is no positive time, or states at these times take more memory than is free.
        """
        if not (np.isfinite(sample) and sample > 0.0):
            raise InputError(f"sample: Expected a positive time, got {sample} s.")
        end = self.t[-1]
        check_memory(f"sample: {sample:g} s", end / sample + 1.0, self._numbers_a_state)
        return regular_times(0.0, end, sample)

    @property
    def _numbers_a_state(self) -> int:
        """Numbers that a state and its sensors take."""
        return 1 + 3 * self.model.n_q + 2 * self.model.n_phi + len(self.model.layout.outputs)

    def own_steps(self) -> States:
        """States on the solver's own steps."""
        behind = _behind_jumps(self.t)
        return States(self.model, self.signals, self.t, self.q, self.v, self.a, self.lam, self.mu, behind)

    def sensors(self, times: Any = None) -> dict[str, np.ndarray]:
        """All sensors by name, on the solver's own steps or at the given times [s]."""
        return (self.own_steps() if times is None else self.at(times)).sensors()


class States:
    """States at given times, and what the model's sensors read there."""

    def __init__(self, model: Model, signals: Signals, t, q, v, a, lam, mu, behind=None) -> None:  # noqa: ANN001
        self.model, self.signals = model, signals
        self.t, self.q, self.v, self.a, self.lam, self.mu = t, q, v, a, lam, mu
        self.behind = np.zeros(len(t), bool) if behind is None else behind

    def coordinate(self, name: str) -> np.ndarray:
        """q of the coordinate of that name, shape (k,)."""
        return self.q[:, self._index(name)]

    def rate(self, name: str) -> np.ndarray:
        """v of the coordinate of that name, shape (k,)."""
        return self.v[:, self._index(name)]

    def _index(self, name: str) -> int:
        index = self.model.layout.index
        if name not in index:
            raise DmsError(f"coordinate '{name}' does not exist. There are: {choices(index)}.")
        return index[name]

    def sensors(self) -> dict[str, np.ndarray]:
        """Every component of every sensor by name, shape (k,) each."""
        y = self.model.measure(self.signals, self.t, self.q, self.v, self.a, self.lam, self.behind)
        return {name: y[:, k] for k, (name, _) in enumerate(self.model.layout.outputs)}


def regular_times(start: float, end: float, sample: float) -> np.ndarray:
    """start, start + sample, start + 2 sample, ... and the end [s]."""
    # A multiple of `sample` that rounding puts just behind the end still counts.
    times = start + np.arange(int(np.floor((end - start) / sample * (1.0 + 1e-12))) + 1) * sample
    times = np.minimum(times, end)
    return times if end - times[-1] < 1e-9 * sample else np.append(times, end)


def _behind_jumps(t: np.ndarray) -> np.ndarray:
    """True at the second of two equal times, and at the first time: the limit from the right."""
    behind = np.zeros(len(t), bool)
    behind[:1] = True
    behind[1:] = np.diff(t) == 0.0
    return behind

"""Repetitions of the exercise: rest, flexion, pause, return, each move of minimum jerk (Flash and Hogan 1985).

Angles stay between 20 and 100 degrees, where the muscles' straight lines have leverage (ecosystem/arm.py).
Which angles, durations and pauses occur is a distribution a field, as in a population of patients; all are assumed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import Field, PrivateAttr, model_validator

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner, matrix
from dms_core.model import MinimumJerk
from exo_env.places import places
from exo_env.settings import Settings
from exo_env.tables import PLAN, WORLD
from exo_env.tasks.movements.course import course_of
from exo_env.tasks.movements.movement import Movement

LOWEST, HIGHEST = 20.0, 100.0
"""Elbow angles between which the exercise stays [deg]."""
MOST_REPETITIONS = 20


class Repetition(Settings):
    """One movement of the reference, done `count` times: one begins `every` so often, or when the last one is over.

    The last two fields are the episode's, not the movement's, and so not in `model_dump()`.
    """

    start_deg: float = Field(default=25.0, ge=LOWEST, le=HIGHEST, description="angle at rest [deg]")
    amplitude_deg: float = Field(default=60.0, gt=0.0, le=HIGHEST - LOWEST, description="of the flexion [deg]")
    rest: float = Field(default=0.4, ge=0.0, le=10.0, description="before the flexion [s]")
    duration: float = Field(default=2.0, ge=0.3, le=20.0, description="of each of the two moves [s]")
    pause: float = Field(default=0.5, gt=0.0, le=10.0, description="at the top [s]")
    count: int = Field(default=1, ge=1, le=MOST_REPETITIONS, exclude=True, description="times that it is done")
    every: float = Field(default=0.0, ge=0.0, exclude=True, description="from one begin to the next, at least [s]")

    @model_validator(mode="after")
    def _within_leverage(self):
        if self.start_deg + self.amplitude_deg > HIGHEST + 1e-9:
            raise ValueError(
                f"start_deg = {self.start_deg} and amplitude_deg = {self.amplitude_deg} lead to "
                f"{self.start_deg + self.amplitude_deg} deg, expected at most {HIGHEST} deg"
            )
        return self

    @classmethod
    def of_row(cls, row: Iterable[float]) -> Self:
        """The repetition of a row of numbers at the places of MOVEMENT."""
        *given, often, every = map(float, row)
        return cls(**dict(zip(MOVED, given, strict=True)), count=int(often), every=every)

    def row(self) -> np.ndarray:
        """All fields as numbers, shape (len(MOVEMENT),); `of_row` takes them back."""
        return np.array([*(getattr(self, name) for name in MOVED), self.count, self.every], dtype=float)

    @property
    def signal(self) -> MinimumJerk:
        """The reference psi(t) [rad]."""
        low, high = np.radians(self.start_deg), np.radians(self.start_deg + self.amplitude_deg)
        move = (self.duration, self.pause, self.duration)
        rests = [self.rest, *[self.interval - sum(move)] * (self.count - 1)]
        times, values = np.cumsum([t for rest in rests for t in (rest, *move)]), (low, high, high, low) * self.count
        # Where there is no rest, a return ends when the next flexion begins.
        kept = np.flatnonzero(np.diff(times, prepend=-1.0) > 0.0)
        return MinimumJerk(times=tuple(times[kept]), values=tuple(values[k] for k in kept))

    @property
    def interval(self) -> float:
        """Time from the begin of one repetition to the begin of the next [s]."""
        return max(self.every, self.rest + 2.0 * self.duration + self.pause)

    def course(self, times: np.ndarray) -> np.ndarray:
        """psi [rad], its rate [rad/s] and its acceleration [rad/s^2] at times [s] in rising order, shape (n, 3)."""
        pieces, course = self.signal.pieces(), np.empty((len(times), 3))
        course_of(pieces.t, pieces.c, np.asarray(times, float), course)
        return course


MOVEMENT = places(("start_deg", "amplitude_deg", "rest", "duration", "pause", "often", "every"))
"""Place of each field of a repetition in its row of numbers."""
MOVED = MOVEMENT._fields[: MOVEMENT.often]
"""Names of the fields that are drawn at random."""


@compiled
def put_pieces(movement, t, c):
    """Fill the pieces of `Repetition.signal`, from a row of numbers in the order of MOVEMENT.

    Args:
        movement: shape (7,).
        t: starts of the pieces [s], shape (n,), n from 4 count + 1. Where there is no rest between repetitions there
            are fewer pieces, and the last stands for them.
        c: their coefficients, shape (n, 6).
    """
    low = math.radians(movement[MOVEMENT.start_deg])
    high = math.radians(movement[MOVEMENT.start_deg] + movement[MOVEMENT.amplitude_deg])
    rest, move, pause = movement[MOVEMENT.rest], movement[MOVEMENT.duration], movement[MOVEMENT.pause]
    between = max(movement[MOVEMENT.every], rest + 2.0 * move + pause) - (move + pause + move)
    # A piece of rest before the first knot.
    c[:], k, now = 0.0, 1, rest
    t[0], t[1] = rest - 1.0, rest
    c[0, 0] = c[1, 0] = low
    for i in range(int(movement[MOVEMENT.often])):
        if i > 0 and now + between > now:
            now += between
            k += 1
            t[k], c[k, 0] = now, low
        for time, value in ((move, high), (pause, high), (move, low)):
            step = value - c[k, 0]
            c[k, 3], c[k, 4], c[k, 5] = 10.0 * step / time**3, -15.0 * step / time**4, 6.0 * step / time**5
            now += time
            k += 1
            t[k], c[k, 0] = now, value
    for i in range(k + 1, t.shape[0]):
        t[i] = t[k]
        c[i] = c[k]


@compiled
def _put_repetitions(w):
    """Fill the pieces of a world's movement."""
    plan = inner(w, WORLD.plan)
    put_pieces(floats(plan, PLAN.movement), floats(plan, PLAN.starts), matrix(plan, PLAN.coefficients))


class Repetitions(Movement):
    """Repetitions to draw from: a distribution for each field of `Repetition`, see patient/distributions.py."""

    kernel: ClassVar[Any] = _put_repetitions
    start_deg: Any = {"uniform": [20.0, 35.0]}
    amplitude_deg: Any = {"uniform": [40.0, 65.0]}
    rest: Any = {"uniform": [0.2, 0.8]}
    duration: Any = {"uniform": [1.6, 2.2]}
    pause: Any = {"uniform": [0.3, 0.8]}
    _count: int = PrivateAttr(default=1)

    @model_validator(mode="after")
    def _possible(self):
        """Both ends of every spread must be repetitions."""
        for end in (0, -1):
            Repetition(**{name: self.spread(name).limits()[end] for name in self.names})
        return self

    def repeated(self, count: int) -> Self:
        """The same, done several times in an episode."""
        found = self.model_copy()
        found._count = count
        return found

    @property
    def pieces(self) -> int:
        """A rest before the first, then flexion, pause, return and rest of each."""
        return 4 * self._count + 1

    def longest(self) -> float:
        """Rest, both moves and the pause at their longest, of all repetitions [s]."""
        rest, move, pause = (float(self.spread(name).limits()[-1]) for name in ("rest", "duration", "pause"))
        return self._count * (rest + 2.0 * move + pause)

    def episode_numbers(self, duration: float) -> tuple[float, ...]:
        """Number of repetitions, and the time from one begin to the next [s]."""
        return float(self._count), duration / self._count

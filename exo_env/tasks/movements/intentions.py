"""What a patient intends who moves where and when he likes: targets, pauses, changes of mind, things picked up.

An episode has one or several windows of equal length. In each the patient rests, then goes from target to target with
a pause at each one, as long as there is time for the whole of a move; so a window ends at rest. A move may be broken
off (the hand goes back to where it came from) or redirected (to another target) on its way, by a second submovement
(submovements.py). In a pause the patient may pick something up, and in a later one put it down. All of it is drawn, and
nothing tells it to the device.

Ranges are assumed, wide enough that the time says nothing about the plan: the mean of psi over many plans is the same
at all times within 1 deg, and explains 0.04 % of the variance of psi (22 % if all began between 20 and 40 deg). Angles
lie between 20 and 100 deg, where the muscles' straight lines have leverage (ecosystem/arm.py), moves of 0.8 to 2 s
with peak rates up to 140 deg/s. In tasks of daily living the elbow moves with peak rates of about that size (Murphy,
Sunnerhagen, Johnels and Willen 2006, J. Neuroeng. Rehabil. 3:18, drinking from a glass).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import Field, PrivateAttr, model_validator

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner, matrix
from exo_env.patient.distributions import Distribution, Draws, distribution
from exo_env.tables import PLAN, WORLD
from exo_env.tasks.movements.intended_plan import Move, Plan
from exo_env.tasks.movements.movement import Movement
from exo_env.tasks.movements.repetition import HIGHEST, LOWEST
from exo_env.tasks.movements.submovements import UNIT, put_sum

MOST_TARGETS = 4
"""Targets in a window at most."""
LIMITS: dict[str, tuple[float, float]] = {
    "start_deg": (LOWEST, HIGHEST),
    "rest": (0.0, 10.0),
    "targets": (1.0, MOST_TARGETS),
    "amplitude_deg": (1.0, HIGHEST - LOWEST),
    "duration": (0.3, 10.0),
    "pause": (0.0, 10.0),
    "picked_up": (0.1, 5.0),
}
"""Least and greatest value of each number: angles [deg], times [s], number of targets, mass [kg]."""


@compiled
def _put_intentions(w):
    """Fill the pieces of psi, and the weight at each control time."""
    plan, period = inner(w, WORLD.plan), floats(w, WORLD.period)[0]
    x, t, c, loads = (
        floats(plan, PLAN.movement),
        floats(plan, PLAN.starts),
        matrix(plan, PLAN.coefficients),
        floats(plan, PLAN.loads),
    )
    n = (t.shape[0] - 1) // 2
    units = np.empty((n, len(UNIT)))
    for i in range(n):
        for j in range(len(UNIT)):
            units[i, j] = x[1 + len(UNIT) * i + j]
    put_sum(x[0], units, t, c)
    # Behind the submovements: time and mass of each change of the weight.
    first, drawn, added, k = 1 + len(UNIT) * n, loads[0], 0.0, 0
    for i in range(first, x.shape[0], 2):
        while k < loads.shape[0] and k * period < x[i] - 1e-9:
            loads[k] = drawn + added
            k += 1
        added += x[i + 1]
    while k < loads.shape[0]:
        loads[k] = drawn + added
        k += 1


class Intentions(Movement):
    """Plans to draw from: a distribution for each number of a move, see patient/distributions.py."""

    kernel: ClassVar[Any] = _put_intentions
    start_deg: Any = Field(default={"uniform": [LOWEST, HIGHEST]}, description="angle at the start [deg]")
    rest: Any = Field(default={"uniform": [0.2, 3.0]}, description="at the begin of a window [s]")
    targets: Any = Field(default={"choice": [2, 3, 4]}, description="in a window, if there is time for them")
    amplitude_deg: Any = Field(default={"uniform": [10.0, 60.0]}, description="of a move, either way [deg]")
    duration: Any = Field(default={"uniform": [0.8, 2.0]}, description="of a move [s]")
    pause: Any = Field(default={"uniform": [0.2, 2.0]}, description="at a target [s]")
    picked_up: Any = Field(default={"uniform": [0.3, 1.0]}, description="mass of what is picked up [kg]")
    changes_of_mind: float = Field(default=0.2, ge=0.0, le=1.0, description="share of moves that are not finished [-]")
    load_changes: float = Field(default=0.25, ge=0.0, le=1.0, description="share of pauses with a change of load [-]")
    _windows: int = PrivateAttr(default=1)

    @model_validator(mode="after")
    def _possible(self):
        for name, (low, high) in LIMITS.items():
            values = self.spread(name).limits()
            if not all(isinstance(x, int | float) and low <= x <= high for x in values):
                raise ValueError(f"{name} = {getattr(self, name)!r}: expected numbers from {low:g} to {high:g}")
        if any(x % 1.0 != 0.0 for x in self._whole_targets()):
            raise ValueError(f"targets = {self.targets!r}: expected whole numbers, as {{choice: [2, 3, 4]}}")
        return self

    def _whole_targets(self) -> tuple[float, ...]:
        """Numbers of targets that there may be; NaN where they are no choice."""
        spread = self.spread("targets")
        known = hasattr(spread, "choice") or hasattr(spread, "constant")
        return tuple(float(x) for x in spread.limits()) if known else (math.nan,)

    def in_windows(self, count: int) -> Self:
        """The same, in several windows of an episode one after the other."""
        found = self.model_copy()
        found.__dict__.pop("_draws", None)
        found._windows = count
        return found

    @property
    def most_units(self) -> int:
        """Submovements at most: each move may have a second one."""
        return 2 * MOST_TARGETS * self._windows

    @property
    def pieces(self) -> int:
        """A rest, then a piece from each begin or end of a submovement."""
        return 2 * self.most_units + 1

    def size(self, duration: float) -> int:
        """Start, three numbers of each submovement, two of each change of load."""
        return 1 + len(UNIT) * self.most_units + 2 * MOST_TARGETS * self._windows

    def values(self, numbers: np.ndarray) -> dict[str, float]:
        """Start, submovements and changes of load, those without any left out by their zeros."""
        found = {"start_deg": float(numbers[0])}
        n = self.most_units
        for i, unit in enumerate(numbers[1 : 1 + len(UNIT) * n].reshape(n, len(UNIT)).tolist(), 1):
            found |= {f"{name}.{i}": x for name, x in zip(UNIT._fields, unit, strict=True)}
        for i, (time, mass) in enumerate(numbers[1 + len(UNIT) * n :].reshape(-1, 2).tolist(), 1):
            found |= {f"load_time.{i}": time, f"load_change.{i}": mass}
        return found

    def draw(self, key: np.uint64, duration: float) -> np.ndarray:
        """The plan of the episode of a key: start, submovements, changes of load."""
        start, *drawn = self._draws.sample(key).tolist()
        plan, numbers = Plan(start, duration / self._windows), iter(drawn)
        for _ in range(self._windows):
            rest, targets = next(numbers), next(numbers)
            moves = [Move(*(next(numbers) for _ in Move._fields)) for _ in range(MOST_TARGETS)]
            plan.add_window(rest, moves[: int(targets)], self.changes_of_mind, self.load_changes)
        return plan.row(self.most_units, MOST_TARGETS * self._windows)

    @cached_property
    def _draws(self) -> Draws:
        """Start, then of each window its rest, its number of targets, and the numbers of as many moves as may be."""
        spreads = {"movement.start_deg": self.spread("start_deg")}
        for i in range(self._windows):
            spreads |= {f"movement.{name}.{i}": self.spread(name) for name in ("rest", "targets")}
            for k in range(MOST_TARGETS):
                spreads |= {f"movement.{name}.{i}.{k}": self._of_move(name) for name in Move._fields}
        return Draws(spreads)

    def _of_move(self, name: str) -> Distribution:
        """Distribution of a field of `Move`."""
        known = name.removeprefix("second_")
        return self.spread(known) if known in LIMITS else distribution({"uniform": [0.0, 1.0]})

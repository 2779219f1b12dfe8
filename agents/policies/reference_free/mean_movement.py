"""Soft controllers of what patients do on the average: by the clock, and without one.

    M = weight(theta) + stiffness (psi(t) - theta) + damping (psi'(t) - rate)

psi is the mean plan over many episodes, drawn from the distributions of the environment's movement. `MeanClock`
follows it in time; `MeanAngle` holds its mean over the episode. Where timing is so wide that a clock knows nothing of
the plan, the first is no better than the second.
"""

from __future__ import annotations

from collections.abc import Hashable
from functools import lru_cache
from typing import Any, ClassVar, cast

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

from dms_core.files.json_text import finite

from ..batch_policy import one_world
from ..tuned import Range
from .assist_moment import CARRIED, SHARE, SMOOTHING, AssistMoment, Seen

DRAWN, SEED = 1000, 2**33
"""Number of drawn plans, and the seed of the first; no evaluation, training or search has these seeds."""


class MeanClock(AssistMoment):
    """Controller of the mean movement by the clock.

    Args:
        stiffness: towards the mean movement [Nm/rad].
        damping: towards its rate [N m s/rad].
        share: see `AssistMoment`.
        carried: see `AssistMoment`.
        smoothing: see `AssistMoment`.
    """

    name, title = "mean_clock", "PD on the mean movement by the clock"
    ranges: ClassVar[dict[str, Range]] = {
        "stiffness": Range(0.3, 60.0, True), "damping": Range(0.05, 8.0, True), "share": SHARE, "carried": CARRIED,
        "smoothing": SMOOTHING,
    }  # fmt: skip

    def begin(self, env: gymnasium.Env | VectorEnv, n: int) -> None:
        """Set the clock to zero."""
        if self._known_env is not env:
            self._course = self.expected(mean_course(one_world(env)))
        super().begin(env, n)
        self._step = 0

    def expected(self, course: np.ndarray) -> np.ndarray:
        """Angle [rad] and rate [rad/s] that are followed, shape (k, 2)."""
        return course

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moment towards the mean movement at this time."""
        x, (angle, rate) = self.numbers, self._course[min(self._step, len(self._course) - 1)]
        self._step += 1
        return self.weight(seen.angle) + x["stiffness"] * (angle - seen.angle) + x["damping"] * (rate - seen.rate)


class MeanAngle(MeanClock):
    """Controller of the mean angle; its numbers are those of `MeanClock`."""

    name, title = "mean_angle", "PD on the mean angle"

    def expected(self, course: np.ndarray) -> np.ndarray:
        """The mean angle, at rest."""
        return np.array([[course[:, 0].mean(), 0.0]])


def mean_course(world: Any) -> np.ndarray:
    """Mean of the plan [rad] and of its rate [rad/s] at the control times, over many drawn episodes, shape (k, 2).

    Args:
        world: an environment; others of its settings are drawn from.
    """
    given = {name: getattr(world.settings, name) for name in sorted(world.settings.model_fields_set)}
    return _mean_course(cast(Hashable, type(world)), Given(finite(given)))


class Given(dict[str, Any]):
    """Settings that can be the key of a cache, by what they say."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(repr(sorted(self.items())))


@lru_cache(maxsize=8)
def _mean_course(kind: Hashable, given: Given) -> np.ndarray:
    made: Any = kind
    env = made(**{**given, "render_mode": None})
    total = 0.0
    for k in range(DRAWN):
        env.reset(seed=SEED + k)
        total = total + env.world.tables.plan.course[:, :2]
    env.close()
    return np.asarray(total) / DRAWN

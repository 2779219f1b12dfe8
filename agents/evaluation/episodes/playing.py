"""An episode of a policy, one control period after the other: the one loop of evaluations, time courses and films."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium

from ...policies.policy import Policy
from .fair_play import begin, shown


class Playing:
    """An episode of a policy at its start; who watches reads the world now, and again after each step.

    Args:
        env: in which.
        acting: the policy.
        seed: of the episode.
        options: of the reset.
    """

    def __init__(self, env: gymnasium.Env, acting: Policy, seed: int, options: dict[str, Any] | None = None) -> None:
        self.env, self.acting = env, acting
        self._observation, self.drawn = env.reset(seed=seed, options=options)
        self.info: dict[str, Any] = self.drawn
        """Of the reset or the latest step."""
        begin(acting, env)

    def steps(self) -> Iterator[tuple[float, dict[str, Any]]]:
        """Play to the end: reward and `info` of each control period, while the world stands at its end."""
        over = False
        while not over:
            action = self.acting(self._observation, shown(self.info, self.env))
            self._observation, reward, terminated, truncated, self.info = self.env.step(action)
            over = terminated or truncated
            yield float(reward), self.info

    @property
    def event(self) -> str | None:
        """What has ended the episode early."""
        return self.info.get("event")

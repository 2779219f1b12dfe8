"""A policy that acts in many worlds at once: a row of observations a world, and a row of actions.

What it remembers are arrays with a component a world, and each of its numbers may be such an array, too. So a search
runs many tries with many patients as one compiled batch, and an evaluation runs the same code with one world.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

from .policy import Policy
from .tuned import Number, numbers


class BatchPolicy(Policy):
    """Base of policies over arrays.

    Args:
        given: numbers that replace the tuned ones, each a number, or one for each world, shape (n,).

    Raises:
        InputError: a number is unknown or outside its range.
    """

    def __init__(self, **given: Number) -> None:
        self.numbers: dict[str, Number] = numbers(self.name, self.ranges, given, self.tuned_in) if self.ranges else {}
        """The numbers by name, in the order of `ranges`."""

    @abstractmethod
    def begin(self, env: gymnasium.Env | VectorEnv, n: int) -> None:
        """Begin an episode in each of n worlds, which have been reset.

        Args:
            env: one environment, or many in a batch; of it, only settings may be read, never its state.
            n: number of worlds.
        """

    @abstractmethod
    def act(self, observations: np.ndarray) -> np.ndarray:
        """The action of each world, shape (n, a), from its observation, shape (n, k)."""

    def reset(self, env: gymnasium.Env) -> None:
        """Begin an episode of one world."""
        self.begin(env, 1)

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """The action of one world."""
        return self.act(np.asarray(observation)[None])[0]


def one_world(env: gymnasium.Env | VectorEnv) -> Any:
    """The environment itself, or the first of a batch: their settings are the same."""
    whole: Any = env.unwrapped
    return getattr(whole, "envs", [whole])[0]

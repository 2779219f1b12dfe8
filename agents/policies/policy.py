"""What a policy is, and how it reads its observation by name."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

from dms_core.errors import InputError, choices

from .tuned import FILE, Range


class Policy(ABC):
    """What acts in an environment. One of your own is a subclass with `title`, `action_mode` and the two methods.

    `python -m agents evaluate --policy module:Class` runs it; its constructor is called without arguments.
    """

    name: ClassVar[str]
    """In tables; of a policy of your own it is what stands behind --policy."""
    title: ClassVar[str]
    training: ClassVar[str | None] = None
    """What trainings that differ in nothing but the seed have in common; None: not trained, or not known."""
    action_mode: ClassVar[str]
    """Action mode of the environment that it acts in."""
    observation: ClassVar[tuple[str, ...]] = ("device",)
    """Groups of the observation that it sees, or single channels as "group.channel"."""
    ranges: ClassVar[dict[str, Range]] = {}
    """Where its numbers may lie, which `python -m agents tune-baselines` searches; arguments of its constructor."""
    tuned_in: ClassVar[str] = FILE
    """File under configs/ with the numbers that were found."""
    informed: ClassVar[bool] = False
    """Whether it may see what reveals the patient's plan (`Task.revealing`), which makes it no fair competitor."""

    @abstractmethod
    def reset(self, env: gymnasium.Env) -> None:
        """Begin an episode; the environment has been reset. Of it, only settings may be read, never its state."""

    @abstractmethod
    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """The action, shape (n,), each number from -1 to 1.

        Args:
            observation: of the environment.
            info: of its last step or reset; empty where the task has a plan to hide (`Task.revealing`).
        """


class Channels:
    """Readings in their units from an observation.

    Args:
        env: whose observations are read; one environment, or many in a batch.
    """

    def __init__(self, env: gymnasium.Env | VectorEnv) -> None:
        world: Any = env.unwrapped
        self._slices = {f"{part.group}.{part.name}": part for part in world.observation_structure}

    def read(self, observation: np.ndarray, name: str, component: int = 0) -> float:
        """One component of a channel [unit of the channel].

        Args:
            observation: of the environment.
            name: of the channel, as "group.channel": two groups may have channels of one name.
            component: its place in the channel.

        Raises:
            InputError: the channel is not observed.
        """
        part = self._part(name)
        return float(observation[part.start + component]) * part.scale

    def columns(self, observations: np.ndarray, name: str) -> np.ndarray:
        """All components of a channel in many worlds [unit of the channel], shape (components, n).

        Args:
            observations: of n worlds, shape (n, k).
            name: of the channel, as "group.channel".

        Raises:
            InputError: the channel is not observed.
        """
        part = self._part(name)
        return observations[:, part.start : part.stop].T.astype(float) * part.scale

    def labels(self, name: str) -> tuple[str, ...]:
        """Label of each component of a channel.

        Raises:
            InputError: the channel is not observed.
        """
        return self._part(name).labels

    def _part(self, name: str) -> Any:
        if name not in self._slices:
            raise InputError(f"the policy reads '{name}', which is not observed; there are {choices(self._slices)}.")
        return self._slices[name]

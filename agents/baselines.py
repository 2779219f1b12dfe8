"""Policies to compare with. Each one sees the observation and does no more than its actions allow.

none    both ropes slack
pid     the paper's PID: the device's own controller with full authority, the reference as its setpoint
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import gymnasium
import numpy as np

from dms_core.errors import InputError, choices


class Policy(ABC):
    """What acts in exo/ElbowLift-v0."""

    name: ClassVar[str]
    title: ClassVar[str]
    action_mode: ClassVar[str]
    """Of the environment it acts in."""
    observation: ClassVar[tuple[str, ...]] = ("device",)
    """Groups that it sees."""

    def reset(self, env: gymnasium.Env) -> None:
        """Begin an episode; the environment has been reset."""

    @abstractmethod
    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """The action, shape (2,).

        Args:
            observation: of the environment.
            info: of its last step or reset.
        """


class NoAssistance(Policy):
    """Both ropes slack."""

    name, title, action_mode = "none", "no assistance", "rope_tension"

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """No tension wanted."""
        return np.array([-1.0, -1.0])


class PidControl(Policy):
    """The paper's PID, with the gains of `python -m exo_env tune`."""

    name, title, action_mode = "pid", "PID", "pid_setpoint"

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """No setpoint change, all authority."""
        return np.array([0.0, 1.0])


POLICIES: dict[str, type[Policy]] = {p.name: p for p in (NoAssistance, PidControl)}


def policy(name: str) -> Policy:
    """A policy by name.

    Raises:
        InputError: there is none of this name; lists those there are.
    """
    if name not in POLICIES:
        raise InputError(f"unknown policy '{name}'. There are: {choices(POLICIES)}.")
    return POLICIES[name]()

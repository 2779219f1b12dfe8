"""Policies to compare with. Each one sees the observation and does no more than its actions allow.

none              both ropes slack; at the start the agonist still holds the arm, and lets go as fast as it can
pid               the paper's PID: the device's own controller, full authority, the reference as its setpoint
pid_yielding      the same with part of the authority, behind the reference by a constant angle, see lagging_pid.py
pid_compensated   such a one with part of the tension that arm, device and load need, see compensation.py
assist_as_needed  learns that tension and forgets it, see assist_as_needed.py

The last three have numbers of their own, tuned for return on the training population (tuning.py).
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from dms_core.errors import InputError, choices

from .assist_as_needed import AssistAsNeeded
from .compensation import CompensatedPid
from .lagging_pid import LaggingPid
from .policy import Policy


class NoAssistance(Policy):
    """Both ropes slack."""

    name, title, action_mode = "none", "no assistance", "rope_tension"

    def reset(self, env: gymnasium.Env) -> None:
        """How many ropes there are."""
        assert env.action_space.shape is not None
        self._ropes = env.action_space.shape

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """Commands of no tension."""
        return np.full(self._ropes, -1.0)


class PidControl(Policy):
    """The paper's PID, with the gains of `python -m exo_env tune`."""

    name, title, action_mode = "pid", "PID", "pid_setpoint"

    def reset(self, env: gymnasium.Env) -> None:
        """The controller's states are in the environment."""

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """No setpoint change, all authority."""
        return np.array([0.0, 1.0])


POLICIES: dict[str, type[Policy]] = {
    p.name: p for p in (NoAssistance, PidControl, LaggingPid, CompensatedPid, AssistAsNeeded)
}


def policy(name: str) -> Policy:
    """A policy by name.

    Raises:
        InputError: there is none of this name; lists those there are.
    """
    if name not in POLICIES:
        raise InputError(f"unknown policy '{name}'. There are: {choices(POLICIES)}.")
    return POLICIES[name]()

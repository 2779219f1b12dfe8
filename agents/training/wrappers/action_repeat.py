"""Decisions slower than control: each action is held for some control periods.

A policy that moves the setpoint of a fast controller has effects over seconds. At 50 decisions a second each of them is
a drop in the noise; held for a fifth of a second each counts ten times as much, and there is a tenth to learn from.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from dms_core.renamed import replaced


class ActionRepeat(VecEnvWrapper):
    """Worlds that take an action for several control periods; their rewards are summed.

    A world whose episode ends on the way goes on with the same action in its next one, whose rewards until the next
    decision do not count.

    Args:
        worlds: that are stepped.
        periods: control periods of an action.
    """

    def __init__(self, worlds: VecEnv, periods: int) -> None:
        super().__init__(worlds)
        self._periods = periods

    def reset(self) -> np.ndarray:
        """First observations."""
        observations = self.venv.reset()
        assert isinstance(observations, np.ndarray)
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Remember the actions."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """All control periods of an action."""
        total, over = np.zeros(self.num_envs, np.float32), np.zeros(self.num_envs, bool)
        last: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for _ in range(self._periods):
            self.venv.step_async(self._actions)
            observations, rewards, ended, infos = self.venv.step_wait()
            total += np.where(over, 0.0, rewards)
            for i in np.flatnonzero(ended & ~over):
                last[i] = infos[i]
            over |= ended
        return observations, total, over, last


__getattr__ = replaced(__name__, {"Held": "It is now ActionRepeat."})

"""Worlds in which a teacher looks on: it says after each observation what it would do."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from .teacher import Teacher


class Taught(VecEnvWrapper):
    """Worlds that show what the student sees.

    `advice`, shape (n, actions), is what the teacher would do now. The teacher begins anew with `reset` alone: behind
    the end of an episode its advice means nothing.

    Args:
        worlds: that show what `teacher.observation` names.
        teacher: of the student.
    """

    def __init__(self, worlds: VecEnv, teacher: Teacher) -> None:
        single: Any = worlds.observation_space
        self._teacher, places = teacher, teacher.student_places
        low, high = single.low[places], single.high[places]
        super().__init__(worlds, observation_space=spaces.Box(low, high, dtype=single.dtype))

    def reset(self) -> np.ndarray:
        """First observations; the teacher begins anew."""
        seen = self.venv.reset()
        assert isinstance(seen, np.ndarray)
        self._teacher.begin(self.num_envs)
        return self._advised(seen)

    def step_wait(self) -> VecEnvStepReturn:
        """A control period."""
        seen, rewards, over, infos = self.venv.step_wait()
        assert isinstance(seen, np.ndarray)
        for i in np.flatnonzero(over):
            last = infos[i]["terminal_observation"]
            infos[i]["terminal_observation"] = last[self._teacher.student_places]
        return self._advised(seen), rewards, over, infos

    def _advised(self, seen: np.ndarray) -> np.ndarray:
        """What the student sees; the teacher sees its own."""
        self.advice = self._teacher.act(seen)
        return seen[:, self._teacher.student_places]

"""Memory for policies without cells: beside each observation, low-pass filtered ones.

    m_tau <- m_tau + (1 - exp(-period / tau)) (observation - m_tau)

with one m for each time constant, at the start of an episode the first observation. What a patient answers to errors
shows over seconds; stacked observations would reach back that far only in hundreds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from dms_core.renamed import replaced


def kept_shares(times: Sequence[float], period: float) -> tuple[float, ...]:
    """Share of a filtered observation that a control period [s] keeps, for each time constant [s]."""
    return tuple(float(x) for x in np.exp(-period / np.asarray(times, float)))


class LowPassObservations(VecEnvWrapper):
    """Worlds whose observations are followed by their filtered ones, shape (num_envs, n + len(kept) size).

    Args:
        worlds: that are observed.
        kept: share of a filtered observation that a control period keeps, one a filter.
        size: components that are filtered, the first ones.
    """

    def __init__(self, worlds: VecEnv, kept: Sequence[float], size: int) -> None:
        single: Any = worlds.observation_space
        self._kept, self._size = np.array(kept)[:, None], size
        low, high = (np.append(limit, np.tile(limit[:size], len(kept))) for limit in (single.low, single.high))
        super().__init__(worlds, observation_space=spaces.Box(low, high, dtype=np.float32))
        self._memory = np.zeros((worlds.num_envs, len(kept), size))

    def reset(self) -> np.ndarray:
        """First observations, and the same as memory."""
        seen = self.venv.reset()
        assert isinstance(seen, np.ndarray)
        self._memory[:] = seen[:, None, : self._size]
        return self._joined(seen, self._memory)

    def step_wait(self) -> VecEnvStepReturn:
        """A control period; an ended episode's last observation has its memory too."""
        seen, rewards, over, infos = self.venv.step_wait()
        assert isinstance(seen, np.ndarray)
        last = {i: infos[i]["terminal_observation"] for i in np.flatnonzero(over)}
        now = seen.copy()
        for i, one in last.items():
            now[i] = one
        self._memory += (1.0 - self._kept) * (now[:, None, : self._size] - self._memory)
        for i, one in last.items():
            infos[i]["terminal_observation"] = self._joined(one[None], self._memory[i : i + 1])[0]
            self._memory[i] = seen[i, : self._size]
        return self._joined(seen, self._memory), rewards, over, infos

    def _joined(self, seen: np.ndarray, memory: np.ndarray) -> np.ndarray:
        return np.concatenate([seen, memory.reshape(len(seen), -1)], axis=1).astype(np.float32)


__getattr__ = replaced(__name__, {"Traces": "It is now LowPassObservations."})

"""Rewards as differences to the same patient under a constant action: what a policy adds, without whom it helps.

Returns differ between patients by far more than any policy can change them, and no critic knows a patient that well. A
twin of each world, of the same seed, takes the same action always, and its reward is taken off. What patient, load and
movement put into a return is gone (common random numbers: Law, Simulation Modeling and Analysis, ch. 11). The best
policy stays the best as long as no event ends an episode, since no action then changes what is taken off; one that ends
early is spared what its twin would have earned in the rest. Returns that are logged in training are differences, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from dms_core.errors import InputError
from dms_core.renamed import replaced


class PairedRewards(VecEnvWrapper):
    """The first half of some worlds; each has its twin in the second half.

    An episode that an event ends takes its twin's with it. Where a twin's ends first, its rewards count as 0 from then
    on.

    Args:
        worlds: an even number, as `make_sb3_worlds` makes them.
        action: of the twins, shape (n,).
    """

    def __init__(self, worlds: Any, action: Sequence[float]) -> None:
        if worlds.num_envs % 2:
            raise InputError(f"{worlds.num_envs} worlds cannot be paired: expected an even number.")
        if len(action) != worlds.action_space.shape[0]:
            raise InputError(f"action of the twins = {list(action)}: expected {worlds.action_space.shape[0]} numbers.")
        super().__init__(worlds)
        self._batch = worlds.worlds
        self.num_envs = worlds.num_envs // 2
        self._actions = np.tile(np.asarray(action, float), (worlds.num_envs, 1))
        self._alone = np.zeros(self.num_envs, bool)
        self._generator = np.random.default_rng()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """World k and its twin begin with seed + k at the next reset."""
        n, seeds = self.num_envs, list(self.venv.seed(seed))
        self._generator = np.random.default_rng([seeds[0] or 0, 1])
        self.venv._seeds[n:] = self.venv._seeds[:n]
        return seeds[:n]

    def reset(self) -> np.ndarray:
        """First observations."""
        if not any(seed is not None for seed in self.venv._seeds):
            self.seed(int(self._generator.integers(2**31)))
        self._alone[:] = False
        seen = self.venv.reset()
        assert isinstance(seen, np.ndarray)
        return seen[: self.num_envs]

    def step_async(self, actions: np.ndarray) -> None:
        """Remember the actions."""
        self._actions[: self.num_envs] = actions

    def step_wait(self) -> VecEnvStepReturn:
        """A control period of every world and its twin."""
        n = self.num_envs
        self.venv.step_async(self._actions)
        seen, rewards, over, infos = self.venv.step_wait()
        assert isinstance(seen, np.ndarray)
        ended, twin_ended = over[:n], over[n:]
        gained = rewards[:n] - np.where(self._alone, 0.0, rewards[n:])
        self._alone |= twin_ended & ~ended
        apart = ended & (self._alone | ~twin_ended)
        return self._together(apart, seen[:n]), gained.astype(np.float32), ended, infos[:n]

    def get_attr(self, attr_name: str, indices: None | int | Iterable[int] = None) -> list[Any]:
        """An attribute of worlds, never of twins."""
        return self.venv.get_attr(attr_name, self._get_indices(indices))

    def set_attr(self, attr_name: str, value: Any, indices: None | int | Iterable[int] = None) -> None:
        """Set an attribute of worlds, never of twins."""
        self.venv.set_attr(attr_name, value, self._get_indices(indices))

    def env_method(
        self, method_name: str, *method_args: Any, indices: None | int | Iterable[int] = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of worlds, never of twins."""
        return self.venv.env_method(method_name, *method_args, indices=self._get_indices(indices), **method_kwargs)

    def env_is_wrapped(self, wrapper_class: Any, indices: None | int | Iterable[int] = None) -> list[bool]:
        """Worlds have no wrappers."""
        return self.venv.env_is_wrapped(wrapper_class, self._get_indices(indices))

    def _together(self, apart: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Begin new episodes where a world ended one at another time than its twin; gives the observations of all."""
        if not apart.any():
            return seen
        n, seeds = self.num_envs, np.full(2 * self.num_envs, None)
        for i in np.flatnonzero(apart):
            seeds[i] = seeds[n + i] = int(self._generator.integers(2**31))
        first, _ = self._batch.reset(seed=seeds.tolist(), options={"reset_mask": np.tile(apart, 2)})
        self._alone[apart] = False
        return np.where(apart[:, None], first[:n], seen)


__getattr__ = replaced(__name__, {"Paired": "It is now PairedRewards."})

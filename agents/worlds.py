"""The environments in which agents learn: the one place where they are made."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from agents.evaluate import ENVIRONMENT


def training_worlds(settings: Mapping[str, Any], n_envs: int, seed: int) -> VecEnv:
    """Environments side by side, seeded; they reset themselves, and `infos` hold an "episode" at each end.

    Args:
        settings: of the environment.
        n_envs: how many.
        seed: environment k has seed + k.

    Raises:
        InputError: a setting is not usable.
    """

    def one() -> gymnasium.Env:
        return Monitor(gymnasium.make(ENVIRONMENT, disable_env_checker=True, **settings))

    makers: list[Callable[[], gymnasium.Env]] = [one] * n_envs
    worlds = DummyVecEnv(makers)
    worlds.seed(seed)
    return worlds

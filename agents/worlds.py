"""The environments in which agents learn: the one place where they are made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from exo_env.sb3 import ElbowLiftVecEnv


def training_worlds(settings: Mapping[str, Any], n_envs: int, seed: int) -> VecEnv:
    """Worlds of one compiled batch, seeded; they reset themselves, and `infos` hold an "episode" at each end.

    Args:
        settings: of the environment.
        n_envs: how many.
        seed: world k has seed + k.

    Raises:
        InputError: a setting is not usable.
    """
    worlds = VecMonitor(ElbowLiftVecEnv(n_envs, **settings))
    worlds.seed(seed)
    return worlds

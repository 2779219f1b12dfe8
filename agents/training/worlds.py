"""The environments in which agents learn: the one place where they are made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from agents.training.wrappers.paired_rewards import Paired
from exo_env.envs.stable_baselines import ElbowLiftVecEnv


def training_worlds(
    settings: Mapping[str, Any], n_envs: int, seed: int, against: Sequence[float] | None = None
) -> VecEnv:
    """Worlds of one compiled batch, seeded; they reset themselves, and `infos` hold an "episode" at each end.

    Args:
        settings: of the environment.
        n_envs: how many.
        seed: world k has seed + k.
        against: action whose reward on the same patient is taken off, see paired.py.

    Raises:
        InputError: a setting is not usable.
    """
    worlds: VecEnv
    if against is None:
        worlds = ElbowLiftVecEnv(n_envs, **settings)
    else:
        worlds = Paired(ElbowLiftVecEnv(2 * n_envs, **settings), against)
    worlds.seed(seed)
    return VecMonitor(worlds)

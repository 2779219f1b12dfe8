"""The worlds in which a policy learns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from stable_baselines3.common.vec_env import VecEnv, VecFrameStack, VecMonitor, VecNormalize

from dms_core.errors import InputError

from ..environment import ENVIRONMENT, make, make_sb3_worlds
from .learners.algorithms import arguments
from .learners.critic import actor_size
from .settings.config import Config
from .wrappers.action_repeat import ActionRepeat
from .wrappers.low_pass import LowPassObservations, kept_shares
from .wrappers.paired_rewards import PairedRewards
from .wrappers.taught import Taught
from .wrappers.teacher import Teacher


def training_worlds(
    settings: Mapping[str, Any],
    n_envs: int,
    seed: int,
    against: Sequence[float] | None = None,
    environment: str = ENVIRONMENT,
) -> VecEnv:
    """Worlds of one compiled batch, seeded; they reset themselves, and `infos` hold an "episode" at each end.

    Args:
        settings: of the environment.
        n_envs: how many.
        seed: world k has seed + k.
        against: action whose reward on the same patient is taken off, see wrappers/paired_rewards.py.
        environment: its id.

    Raises:
        InputError: a setting is not usable.
    """
    worlds: VecEnv
    if against is None:
        worlds = make_sb3_worlds(environment, n_envs, **settings)
    else:
        worlds = PairedRewards(make_sb3_worlds(environment, 2 * n_envs, **settings), against)
    worlds.seed(seed)
    return VecMonitor(worlds)


def observed_settings(config: Config) -> dict[str, Any]:
    """Settings of the training worlds: what only a critic or a teacher sees stands behind what the policy sees."""
    if config.training.imitation is not None:
        return config.env_kwargs | {"observation": teacher_of(config).observation}
    if not config.training.critic:
        return config.env_kwargs
    env: Any = make(config.environment, **config.env_kwargs)
    own = env.unwrapped.settings.observation
    env.close()
    return config.env_kwargs | {"observation": [*own, *config.training.critic]}


def teacher_of(config: Config) -> Teacher:
    """The teacher of an imitation.

    Raises:
        InputError: there is none of this name, or it acts in another environment.
    """
    assert config.training.imitation is not None
    return Teacher(config.training.imitation.teacher, config.environment, config.env_kwargs)


def wrapped(config: Config, seed: int) -> VecEnv:
    """Training worlds of a configuration, observations stacked and then normalised if it says so.

    rl_zoo3 normalises first; then algorithms with a replay buffer could not have both.
    """
    arguments(config)
    more, against = config.training.critic, config.training.against
    worlds = training_worlds(observed_settings(config), config.n_envs, seed, against, config.environment)
    single: Any = worlds.action_space
    for name, action in (("start", config.training.start), ("against", against)):
        if action is not None and len(action) != single.shape[0]:
            raise InputError(f"training.{name} = {list(action)}: expected {single.shape[0]} numbers, one an action.")
    if config.training.imitation is not None:
        worlds = Taught(worlds, teacher_of(config))
    period = config.training.hold * worlds.get_attr("period", 0)[0]
    if config.training.hold > 1:
        worlds = ActionRepeat(worlds, config.training.hold)
    if config.frame_stack > 1:
        worlds = VecFrameStack(worlds, config.frame_stack)
    if config.training.traces:
        kept = kept_shares(config.training.traces, period)
        worlds = LowPassObservations(worlds, kept, config.frame_stack * actor_size(worlds, more))
    return worlds if config.normalize is None else VecNormalize(worlds, **config.normalize)

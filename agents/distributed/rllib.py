"""The environment for RLlib (https://docs.ray.io/en/latest/rllib), which makes environments by names of its own.

    from agents.distributed.rllib import register
    from ray.rllib.algorithms.ppo import PPOConfig

    register()
    config = PPOConfig().environment("exo/ElbowLift-v0", env_config={"patient": "mixed"})

RLlib of Ray 2.60 wants gymnasium 1.2.2, which this environment runs with too (`make test-rllib`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium

from agents.evaluation.evaluate import ENVIRONMENT
from agents.training.config import ENVIRONMENT_ID


def make(settings: Mapping[str, Any]) -> gymnasium.Env:
    """An environment from RLlib's `env_config`."""
    return gymnasium.make(ENVIRONMENT, disable_env_checker=True, **dict(settings))


def register() -> str:
    """Tell RLlib of the environment; returns the name it then has."""
    from ray.tune.registry import register_env

    register_env(ENVIRONMENT_ID, make)
    return ENVIRONMENT_ID

"""The environments for RLlib (https://docs.ray.io/en/latest/rllib), which makes environments by names of its own.

    from exo_agents.distributed.rllib import register
    from ray.rllib.algorithms.ppo import PPOConfig

    config = PPOConfig().environment(register(), env_config={"patient": "mixed"})

In a checkout the first line is `from agents.distributed.rllib import register`. RLlib of Ray 2.60 wants gymnasium
1.2.2, which these environments run with too (`make test-rllib`).
"""

from __future__ import annotations

from ..environment import ENVIRONMENT, environment_id, make


def register(environment: str = ENVIRONMENT) -> str:
    """Tell RLlib of an environment.

    Args:
        environment: its id, with the module where another package registers it.

    Returns:
        The name that it then has.
    """
    from ray.tune.registry import register_env

    name = environment_id(environment)
    register_env(name, lambda settings: make(environment, **dict(settings)))
    return name

"""A wrapper that makes an environment anew with other settings, for tools that let a user add wrappers only."""

from __future__ import annotations

from typing import Any

import gymnasium

from dms_core.errors import InputError


class WithSettings(gymnasium.Wrapper):
    """An environment made again from its id with settings of one's own.

    rl_zoo3 gives a file's `env_kwargs` to the environments that it trains in, and none to those that it evaluates in;
    its `env_wrapper` stands around both.

    Args:
        env: to be replaced; wrappers that are around it already stay.
        settings: arguments of the environment.

    Raises:
        InputError: the environment was not made by `gymnasium.make`, or a setting is not usable.
    """

    def __init__(self, env: gymnasium.Env, **settings: Any) -> None:
        spec = env.unwrapped.spec
        if spec is None:
            raise InputError(f"{type(env.unwrapped).__name__} has no id to be made from; make it by gymnasium.make.")
        render_mode = env.unwrapped.render_mode
        made = gymnasium.make(spec.id, disable_env_checker=True, **{"render_mode": render_mode, **settings}).unwrapped
        if not isinstance(env, gymnasium.Wrapper):
            super().__init__(made)
            return
        innermost: gymnasium.Wrapper = env
        while isinstance(innermost.env, gymnasium.Wrapper):
            innermost = innermost.env
        innermost.env.close()
        innermost.env = made
        super().__init__(env)

"""What a policy may see of a task that hides the patient's plan.

Its observation has no group that reveals the plan, unless the policy says that it is `informed`; `info` is empty; and
the environment that it begins with is one of the same settings in which no episode has begun.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import gymnasium

from dms_core.errors import InputError

from ...policies.policy import Policy

_unplayed: WeakKeyDictionary[gymnasium.Env, gymnasium.Env] = WeakKeyDictionary()


def hidden_by(env: gymnasium.Env) -> tuple[str, ...]:
    """Groups of observations that reveal the patient's plan; none where the task hides nothing."""
    world: Any = env.unwrapped
    return world.task.revealing


def check_fair(policy: Policy, env: gymnasium.Env) -> None:
    """Refuse a policy that sees more than it may.

    Raises:
        InputError: names the groups.
    """
    world: Any = env.unwrapped
    seen = {part.group for part in world.observation_structure}
    told = [group for group in hidden_by(env) if group in seen]
    if told and not policy.informed:
        raise InputError(
            f"policy '{policy.name}' sees the group '{told[0]}', which reveals the plan that "
            f"{type(world.task).__name__} hides: expected other groups. A policy that is to know the plan, as an "
            "oracle does, says so by informed = True."
        )


def begin(policy: Policy, env: gymnasium.Env) -> None:
    """Have a policy begin an episode of an environment, which has been reset."""
    if not hidden_by(env):
        policy.reset(env)
        return
    if env not in _unplayed:
        world: Any = env.unwrapped
        given = {name: getattr(world.settings, name) for name in world.settings.model_fields_set}
        _unplayed[env] = type(world)(**{**given, "render_mode": None})
    policy.reset(_unplayed[env])


def shown(info: dict[str, Any], env: gymnasium.Env) -> dict[str, Any]:
    """What a policy is shown of the `info` of a step or reset."""
    return {} if hidden_by(env) else info

"""Environments by id: the one place where they are looked up.

Any environment that is registered with Gymnasium is found; one of another package is named with the module that
registers it, "module:namespace/Name-v0". An older version of an id is taken as the newest.
"""

from __future__ import annotations

import importlib
import sys
from functools import cache

import gymnasium
from gymnasium.envs.registration import EnvSpec, load_env_creator, parse_env_id

from dms_core.errors import InputError, choices
from exo_env.envs.base_env import AssistanceEnv


def environment_id(environment: str, say: bool = True) -> str:
    """The id under which an environment is registered now, in place of an older version of it.

    Args:
        environment: an id, with or without the module that registers it: "exo/ElbowLift-v2", "module:mine/Task-v1".
        say: tell the user where a newer version takes the place of an older one.

    Raises:
        InputError: no environment of this name is registered, or the version is newer than those that are.
    """
    module, _, name = environment.rpartition(":")
    if module:
        try:
            importlib.import_module(module)
        except ImportError as error:
            raise InputError(f"environment '{environment}': module '{module}' cannot be imported: {error}.") from None
    newest = _newest(name)
    if newest is None:
        # What a module registers has its namespace.
        others = [other for other in gymnasium.registry if module and other.startswith(f"{name.partition('/')[0]}/")]
        raise InputError(
            f"environment '{environment}' is not registered. There are: {choices([*environments(), *others])}, and "
            "'module:id' of a module that registers one."
        )
    if newest != name and say:
        _say_once(f"note: {name} is now {newest}, which is used in its place.")
    return newest


def spec_of(environment: str) -> EnvSpec:
    """What is registered under an id, or under the newest version of it.

    Raises:
        InputError: as `environment_id`; or the environment is not built on this package's.
    """
    spec = gymnasium.spec(environment_id(environment))
    entry = spec.entry_point
    made = load_env_creator(entry) if isinstance(entry, str) else entry
    if isinstance(made, type) and not issubclass(made, AssistanceEnv):
        raise InputError(
            f"environment '{environment}' is a {made.__name__}: expected one built on AssistanceEnv of "
            "exo_env.envs.base_env."
        )
    return spec


def environments() -> list[str]:
    """Ids of the environments that come with this package."""
    return [name for name in gymnasium.registry if name.startswith("exo/")]


def _newest(name: str) -> str | None:
    """The id itself, the newest version where it is an older one, or None."""
    try:
        namespace, base, version = parse_env_id(name)
    except gymnasium.error.Error:
        return None
    same = [s for s in gymnasium.registry.values() if (s.namespace, s.name) == (namespace, base)]
    versions = {s.version: s.id for s in same if s.version is not None}
    if name in gymnasium.registry and (version is None or name not in environments()):
        return name
    if version is None or not versions or version > max(versions):
        return None
    return versions[max(versions)]


@cache
def _say_once(sentence: str) -> None:
    print(sentence, file=sys.stderr)

"""The sections of a configuration file, as they stand: which one is taken, and single values replaced."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from dms_core.errors import InputError, choices
from dms_core.files.yaml_builder import MOST_DEPTH
from dms_core.files.yaml_text import read_value
from dms_core.validation import cut, shown

from ...environment import ENVIRONMENT, environment_id, environments
from .rl_zoo_text import read_call

TRAINING = "training"
MAPPINGS = ("policy_kwargs", "env_kwargs", "normalize")
"""Keys whose mapping may stand as text."""
SAME_SETTINGS = "exo_env.envs.with_settings.WithSettings"
"""The only env_wrapper that a section may have; its arguments are the section's env_kwargs."""


def chosen(content: Mapping[str, Any], environment: str | None) -> tuple[str, str]:
    """Name of the section to take, and the id of its environment, which may be a newer version."""
    named = [str(k) for k in content if k != TRAINING]
    asked = None if environment is None else environment_id(environment)
    known = {name: one for name in named if (one := _registered(name)) is not None}
    of = [name for name, one in known.items() if one == (asked or ENVIRONMENT)]
    if not of and asked is None:
        of = list(known)
        if len(of) > 1:
            raise InputError(f"the configuration is for {choices(named)}; say which with --env.")
    if not of:
        raise InputError(
            f"the configuration is for {choices(named) if named else 'no environment'}; "
            f"here there is {asked or choices(environments())}."
        )
    # A section of the very id comes before one of an older version.
    name = next((name for name in of if name == known[name]), of[0])
    return name, environment_id(name)


def _registered(name: str) -> str | None:
    """The id for a section's name; one with a module would be imported, which no file may bring about."""
    if ":" in name:
        return None
    try:
        return environment_id(name, say=False)
    except InputError:
        return None


def sections(content: Mapping[str, Any], name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The environment's section and ours."""
    for key, value in ((name, content[name]), (TRAINING, content.get(TRAINING, {}))):
        if not isinstance(value, Mapping):
            raise InputError(f"section '{key}' holds {shown(value)}: expected a mapping of keys to values.")
    section = dict(content[name])
    for key in MAPPINGS:
        if isinstance(section.get(key), str):
            try:
                section[key] = read_call(section[key])
            except InputError as error:
                raise InputError(f"{key}: {error}") from None
    return section, dict(content.get(TRAINING, {}))


def check_wrapper(section: dict[str, Any]) -> None:
    """Take out the wrapper that is there for rl_zoo3; its arguments are to be the env_kwargs, and no others are run."""
    wrapper = section.pop("env_wrapper", None)
    if wrapper is None:
        return
    (given,) = wrapper if isinstance(wrapper, list) and len(wrapper) == 1 else (wrapper,)
    if not isinstance(given, Mapping) or list(given) != [SAME_SETTINGS]:
        raise InputError(f"env_wrapper = {shown(wrapper)}: expected none, or {SAME_SETTINGS} with the env_kwargs.")
    if given[SAME_SETTINGS] != section.get("env_kwargs", {}):
        raise InputError(f"env_wrapper: {SAME_SETTINGS} has other settings than env_kwargs; expected the same.")


def override_values(section: dict[str, Any], training: dict[str, Any], texts: Sequence[str]) -> None:
    """Replace values, in the order in which they are given; each key stands once."""
    keys = [text.partition("=")[0].strip() for text in texts]
    for key, text in zip(keys, texts, strict=True):
        if keys.count(key) > 1:
            raise InputError(f"--set {cut(text)}: '{cut(key)}' stands {keys.count(key)} times; expected once.")
        _override(section, training, text)


def _override(section: dict[str, Any], training: dict[str, Any], text: str) -> None:
    """Replace one value."""
    key, equals, value = text.partition("=")
    path = key.strip().split(".")
    if not equals or not all(path) or len(path) > MOST_DEPTH:
        raise InputError(f"--set {cut(text)}: expected key=value, for example n_timesteps=1000.")
    place: Any = section
    if path[0] == TRAINING and len(path) > 1:
        place, path = training, path[1:]
    for part in path[:-1]:
        place[part] = dict(place.get(part) or {}) if isinstance(place.get(part), Mapping | None) else None
        place = place[part]
        if place is None:
            raise InputError(f"--set {cut(text)}: '{cut(part)}' is not a mapping.")
    try:
        new = read_value(value)
        place[path[-1]] = read_call(new) if path[-1] in MAPPINGS and isinstance(new, str) else new
    except InputError as error:
        raise InputError(f"--set {cut(key)}: {error}") from None

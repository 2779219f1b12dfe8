"""Settings filled from YAML: frozen, checked, every mistake an InputError with key, value and what is right."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from dms_core.errors import InputError
from dms_core.files.config_files import config_file
from dms_core.files.yaml_text import read_yaml, said_of
from dms_core.validation import Checked, plain, shown


class Settings(Checked):
    """Base of all settings: frozen, and checked when they are made."""

    def __hash__(self) -> int:
        """Hash of the class and of all values, which may be mappings too."""
        return hash((type(self), self.model_dump_json()))

    @classmethod
    def from_config(cls, name: str) -> Self:
        """These settings from a shipped file, by its path inside `configs`.

        Raises:
            InputError: the file is missing or wrong; names file, key and value.
        """
        return cls.from_file(config_file(name))

    @classmethod
    def from_file(cls, path: str | Path) -> Self:
        """These settings from a YAML file.

        Raises:
            InputError: the file is missing or wrong; names file, key and value.
        """
        with said_of(path):
            return cls(**read_yaml(path))

    def changed(self, **changes: Any) -> Self:
        """A checked copy with other values; a mapping given for settings within these changes only what it names.

        Example:
            >>> device.changed(lower_link={"mass": 1.0}).lower_link.inertia == device.lower_link.inertia
            True
        """
        merged = {name: _merged(getattr(self, name, None), change) for name, change in changes.items()}
        return type(self)(**{**dict(self), **merged})


def _merged(now: Any, change: Any) -> Any:
    """A value with a change in it: settings and mappings of settings are changed by mappings, all else is replaced."""
    if not isinstance(change, Mapping):
        return change
    if isinstance(now, Settings):
        return now.changed(**change)
    if isinstance(now, Mapping) and now and all(isinstance(x, Settings) for x in now.values()):
        return {**now, **{name: _merged(now.get(name), x) for name, x in change.items()}}
    return change


def given_mapping(key: str, value: Any, expected: str) -> dict[str, Any]:
    """A mapping that a user gave, with plain numbers; None is an empty one.

    Args:
        key: name of the setting.
        value: what was given.
        expected: words for what the mapping holds.

    Raises:
        InputError: it is no mapping, or a key is no word.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        raise InputError(f"{key} = {shown(value)}: expected a mapping with {expected}.")
    return plain(value)

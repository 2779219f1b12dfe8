"""Settings filled from YAML: frozen, checked, every mistake an InputError with key, value and what is right."""

from __future__ import annotations

from typing import Any, Self

from dms_core.config_files import config_file
from dms_core.errors import InputError
from dms_core.validation import Checked
from dms_core.yaml_text import read_yaml


class Settings(Checked):
    """Base of all settings."""

    @classmethod
    def from_config(cls, name: str) -> Self:
        """These settings from a shipped file, by its path inside `configs`.

        Raises:
            InputError: the file is missing or wrong; names file, key and value.
        """
        path = config_file(name)
        try:
            return cls(**read_yaml(path))
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    def changed(self, **changes: Any) -> Self:
        """A checked copy with other values."""
        return type(self)(**{**dict(self), **changes})

"""Values as a message shows them: 23.0, never np.float64(23.0)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dms_core.errors import InputError


def plain(value: Any) -> Any:
    """The value with Python's own numbers in place of NumPy's, in lists, tuples and mappings too."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {plain(key): plain(x) for key, x in value.items()}
    if type(value) in (list, tuple):
        return type(value)(map(plain, value))
    return value


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
        raise InputError(f"{key} = {plain(value)!r}: expected a mapping with {expected}.")
    return plain(value)

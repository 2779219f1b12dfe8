"""Reading JSON of unknown origin: bounded in time and memory, every mistake one sentence with the file and the key.

Stricter than Python's own reader, each time because the usual rule hides a mistake or lets a file harm: a key that
stands twice, numbers that are not finite or endless, text that is no Unicode, and deep nesting are refused. What a file
has to hold is said by a class (`Checked`), of which `Each` checks the parts one after another, up to the first mistake.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import AfterValidator

from dms_core.errors import InputError, both_ends, printable
from dms_core.files.input_file import decoded, read_bytes
from dms_core.validation import Checked

Kind = TypeVar("Kind", bound=Checked)
MOST_BYTES = 64 << 20
"""Size up to which a file is read [byte]: an evaluation of ten thousand episodes has half of it."""
LONGEST_SENTENCE = 240
"""Characters of a sentence on a file's contents, which may be of any length."""
DEEPEST, MOST_KEYS, MOST_VALUES, LONGEST_INTEGER = 50, 1_000, 1_000_000, 100
"""Levels of nesting, keys of a mapping, values of a file, and characters of a whole number."""


def read_json(path: str | Path, most: int = MOST_BYTES) -> Any:
    """What a JSON file holds.

    Args:
        path: of the file.
        most: size up to which it is read [byte].

    Raises:
        InputError: it cannot be read, is too large or is no JSON; names it.
    """
    return parse_json(decoded(path, read_bytes(path, most)), f"file '{path}'")


def parse_json(text: str, where: str) -> Any:
    """What a JSON text stands for.

    Args:
        text: any.
        where: words for it in messages.

    Raises:
        InputError: it is no JSON, or holds what is refused.
    """
    if not text.strip():
        raise InputError(f"{where} is no JSON: it is empty.")
    if text.count(",") + text.count("[") + text.count("{") > MOST_VALUES:
        raise InputError(f"{where} holds more than {MOST_VALUES} values.")
    try:
        found = json.loads(
            text, object_pairs_hook=_mapping, parse_constant=_no_constant, parse_float=_finite, parse_int=_whole
        )
        _check(found)
    except RecursionError:
        raise InputError(f"{where} is nested deeper than {DEEPEST} levels.") from None
    except ValueError as error:
        raise InputError(f"{where} is no JSON: {brief(str(error))}.") from None
    return found


def checked(kind: type[Kind], content: Any, where: str) -> Kind:
    """What a text stands for, as a class says that it has to be.

    Raises:
        InputError: a key is missing or unknown, or a value is not as it has to be; names the first.
    """
    try:
        return kind(**_as_mapping(content))
    except InputError as error:
        raise InputError(f"{where}: {brief(_unlabelled(kind, error))}") from None


def Each(kind: type[Checked]) -> AfterValidator:  # noqa: N802
    """Annotation of a list or mapping whose items have to be as a class says; the first mistake ends the check."""

    def check(value: Any) -> Any:
        for key, one in value.items() if isinstance(value, dict) else enumerate(value):
            try:
                kind(**_as_mapping(one))
            except InputError as error:
                raise InputError(f"{brief(str(key), 60)}: {_unlabelled(kind, error)}") from None
        return value

    return AfterValidator(check)


def brief(text: str, most: int = LONGEST_SENTENCE) -> str:
    """The first sentence of several lines, cut in its middle where it is long, without control characters."""
    first, *more = [line for line in text.splitlines() if line.strip()] or [""]
    return both_ends(printable(both_ends(first, most)), most) + (f" (and {len(more)} more)" if more else "")


def finite(value: Any) -> Any:
    """The value for a JSON file, which has no NaN: what is not finite becomes null."""
    if isinstance(value, Mapping):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _as_mapping(content: Any) -> dict[str, Any]:
    if not isinstance(content, dict):
        raise InputError(f"expected a mapping of keys to values, got a {type(content).__name__}.")
    return content


def _unlabelled(kind: type[Checked], error: InputError) -> str:
    """What is wrong without the class, which is no word of the file's author."""
    return "\n".join(re.sub(rf"^{kind.__name__}( '.*?')?: ", "", line) for line in str(error).splitlines())


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A mapping of a file."""
    if len(pairs) > MOST_KEYS:
        raise ValueError(f"a mapping has {len(pairs)} keys, more than {MOST_KEYS}")
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key '{brief(key, 60)}' stands twice")
        found[key] = value
    return found


def _no_constant(text: str) -> float:
    raise ValueError(f"{text} is no number")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {brief(text, 60)} is not finite")
    return value


def _whole(text: str) -> int:
    if len(text) > LONGEST_INTEGER:
        raise ValueError(f"a whole number has {len(text)} characters")
    return int(text)


def _check(found: Any) -> None:
    """Refuses deep nesting and text that is no Unicode, level by level."""
    level = [found]
    for _ in range(DEEPEST + 1):
        if not level:
            return
        below: list[Any] = []
        for one in level:
            if isinstance(one, str):
                _check_text(one)
            elif isinstance(one, list):
                below += one
            elif isinstance(one, dict):
                below += one
                below += one.values()
        level = below
    raise RecursionError


def _check_text(text: str) -> None:
    if not text.isascii() and any("\ud800" <= c <= "\udfff" for c in text):
        raise ValueError(f"the text '{brief(text, 60)}' holds half a character (a lone surrogate)")

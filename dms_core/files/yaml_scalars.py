"""What a scalar of a YAML file stands for: the core schema of YAML 1.2, and where YAML 1.1 differs from it.

    YAML        010   0o10  1:30   1_000  1e5     yes    2020-01-01  0x1F  .5   +1
    1.2 (ours)  10    8     text   text   1e5     text   text        31    0.5  1
    1.1         8     text  90     1000   text    true   a date      31    0.5  1

PyYAML, by which rl_zoo3 reads its files, is a reader of YAML 1.1.
"""

from __future__ import annotations

import math
import re
from typing import Any

import yaml

MOST_DIGITS = 300
"""Longest whole number; longer ones are no floating-point number any more."""
STANDARD = "tag:yaml.org,2002:"
TAGS = ("null", "bool", "int", "float", "str")
"""Tags that a scalar may have, as in `!!float 1e6`."""

_NULL = re.compile(r"null|Null|NULL|~|")
_BOOL = re.compile(r"(true|True|TRUE)|false|False|FALSE")
_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(
    r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
)
NUMBER = re.compile(f"^(?:{_INT.pattern}|{_FLOAT.pattern})$")
"""Whatever is a number in YAML 1.2."""
UNPRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that may not stand in a file, nor be meant by an escape such as "\\0": no name or path may hold them."""


def plain_scalar(text: str) -> Any:
    """What a scalar without quotes and without a tag stands for.

    Raises:
        ValueError: it is a whole number that nothing can hold.
    """
    for kind, pattern in (("null", _NULL), ("bool", _BOOL), ("int", _INT), ("float", _FLOAT)):
        if pattern.fullmatch(text):
            return tagged_scalar(kind, text)
    return text


def tagged_scalar(kind: str, text: str) -> Any:
    """What a scalar stands for, its kind being known.

    Args:
        kind: one of TAGS.
        text: as it stands in the file, without quotes.

    Raises:
        ValueError: the text is none of this kind.
    """
    if kind == "str":
        return text
    if kind == "null" and _NULL.fullmatch(text):
        return None
    if kind == "bool" and (found := _BOOL.fullmatch(text)):
        return found[1] is not None
    if kind == "int" and _INT.fullmatch(text):
        return _whole(text)
    if kind == "float" and _FLOAT.fullmatch(text):
        # YAML writes .inf and .nan, Python inf and nan.
        return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
    raise ValueError(f"it is no {kind}")


def _whole(text: str) -> int:
    """A whole number in decimal, octal (0o) or hexadecimal (0x) digits."""
    if len(text) > MOST_DIGITS:
        raise ValueError(f"it has {len(text)} digits; expected at most {MOST_DIGITS}")
    return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))


class OlderReader:
    """How YAML 1.1 reads scalars, as PyYAML does it."""

    def __init__(self) -> None:
        self._loader = yaml.SafeLoader("")

    def difference(self, text: str, tag: str | None, implicit: tuple[bool, bool], now: Any) -> str | None:
        """How a scalar differs between YAML 1.1 and 1.2, and what to write instead; None where it does not.

        Args:
            text: as it stands in the file, without quotes.
            tag: written in front of it, or None.
            implicit: whether it stands plain, whether it stands in quotes.
            now: what it is in YAML 1.2.
        """
        used = tag if tag not in (None, "!") else self._loader.resolve(yaml.ScalarNode, text, implicit)
        try:
            older = yaml.SafeLoader.yaml_constructors[used](self._loader, yaml.ScalarNode(used, text))
        except Exception:  # PyYAML does not catch what int() and datetime.date() refuse
            older, first = None, "is an error in YAML 1.1, by which rl_zoo3 reads this file,"
        else:
            if type(older) is type(now) and (older == now or older != older and now != now):
                return None
            first = f"is {_in_words(older)} in YAML 1.1, by which rl_zoo3 reads this file,"
        ways = list(
            dict.fromkeys(
                w for value in sorted((older, now), key=lambda x: isinstance(x, str)) if (w := _both_read(value, text))
            )
        )
        return f"{text} {first} and {_in_words(now)} in YAML 1.2. Write {' or '.join(ways)}"


def _in_words(value: Any) -> str:
    """A value with its kind."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return f"the number {value!r}"
    if value is None:
        return "null"
    return "text" if isinstance(value, str) else f"a {type(value).__name__}"


def _both_read(value: Any, text: str) -> str:
    """How a value is written so that both versions read it; "" where there is no such way."""
    if isinstance(value, str):
        return f"'{text}' in quotes"
    if isinstance(value, bool) or isinstance(value, int | float) and math.isfinite(value):
        return yaml.safe_dump(value).partition("\n")[0]
    return ""

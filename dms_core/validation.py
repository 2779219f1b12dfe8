"""Values that a user gives, checked: what pydantic finds wrong, said in plain sentences.

Each sentence names the element, the key, the value and what would be right:

    rigid_body 'rod': mass = -1: Expected a number above 0.
    rigid_body 'rod': position = (0.0, 1.0): Expected 3 items, got 2.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema

from dms_core.errors import DmsError, InputError, both_ends, choices, printable
from dms_core.strict_types import strict

_EXPECTED: dict[str, str] = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing_size": "a whole number of fewer than 19 digits",
    "finite_number": "a finite number",
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a text",
    "string_too_short": "a text that is not empty",
    "literal_error": "{expected}",
    "enum": "{expected}",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a mapping of keys to values",
    "model_type": "a mapping of keys to values",
    "model_attributes_type": "a mapping of keys to values",
    "union_tag_invalid": "a 'kind' out of {expected_tags}",
    "union_tag_not_found": "a mapping with the key 'kind'",
}
"""What would have been right, by pydantic's type of error; the fields in braces are those of its context."""


LONGEST, MOST_SENTENCES, LONGEST_SENTENCE = 70, 5, 1000
"""Characters of a value in a message, sentences of a message, and characters of a sentence."""


class Checked(BaseModel):
    """Base of everything that is checked: frozen, without unknown keys, without infinite numbers.

    A wrong value raises `wrong`, with one sentence for each mistake. Types are strict: a number in quotes is text, true
    is no number and 1 is not true, in files and in Python. Numbers and arrays of NumPy are taken, and 5.0 where a whole
    number is expected.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    wrong: ClassVar[type[DmsError]] = InputError

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**plain(data))
        except ValidationError as error:
            label = getattr(type(self), "kind", "") or type(self).__name__
            who = f"{label} '{data.get('name', '?')}'" if "name" in type(self).model_fields else label
            raise self.wrong(sentences(error, who, type(self).model_fields)) from None

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler, /) -> CoreSchema:
        """Pydantic's schema of the class with strict numbers and truth values in it."""
        return strict(handler(source), cls)


SMALLEST, LARGEST = 1e-30, 1e30
"""Sizes of the numbers of a declaration: products of as many as an equation has stay far from the ends of what a float
holds, and in SI units nothing that moves is smaller or larger."""


def numbers_in(value: Any, key: str = "") -> Iterator[tuple[str, float]]:
    """Every number in a declaration, by its keys and places joined with dots ('path.1.point.0')."""
    if isinstance(value, BaseModel):
        for name in type(value).model_fields:
            yield from numbers_in(getattr(value, name), f"{key}.{name}" if key else name)
    elif isinstance(value, tuple):
        for k, item in enumerate(value):
            yield from numbers_in(item, f"{key}.{k}")
    elif isinstance(value, float):
        yield key, value


def check_sizes(value: BaseModel) -> None:
    """Refuse numbers that are no measure of anything, with which equations overflow.

    Raises:
        ValueError: names the key and what is allowed.
    """
    for key, number in numbers_in(value):
        if number != 0.0 and not SMALLEST <= abs(number) <= LARGEST:
            raise ValueError(f"{key} = {number}: Expected 0 or a number of a size from {SMALLEST:g} to {LARGEST:g}")


def sentences(error: ValidationError, who: str, allowed: Any = ()) -> str:
    """What is wrong, one sentence a line.

    Args:
        error: what pydantic raised.
        who: what the values are for, such as "revolute 'elbow'".
        allowed: the keys that exist.
    """
    found, lengths = _without_repeats(error.errors()), dict[tuple, int]()
    for e in found:
        if e["type"] == "missing" and e["loc"] and isinstance(e["loc"][-1], int):
            lengths[e["loc"][:-1]] = e["loc"][-1] + 1
    # Each missing item of a list is a mistake of its own to pydantic, but one to its author.
    said = dict.fromkeys(_sentence(dict(e), cut(who), allowed, lengths) for e in found[:MOST_SENTENCES])
    lines = [_bounded(line) for line in said]
    if len(found) > MOST_SENTENCES:
        lines.append(f"{cut(who)}: {len(found) - MOST_SENTENCES} further mistakes.")
    return "\n".join(lines)


def _without_repeats(found: list[Any]) -> list[Any]:
    """Mistakes, those of unknown keys first and as one for each mapping: a file of another kind has many of them."""
    unknown: dict[tuple, Any] = {}
    for e in found:
        if e["type"] == "extra_forbidden":
            first = unknown.setdefault(e["loc"][:-1], e)
            first.setdefault("keys", []).append(str(e["loc"][-1]))
    return [*unknown.values(), *(e for e in found if e["type"] != "extra_forbidden" and not _counted_wrong(e))]


def _counted_wrong(error: Any) -> bool:
    """Whether a list is only too short because of items that are mistakes of their own."""
    return error["type"] == "too_short" and len(error["input"]) >= error["ctx"]["min_length"]


def _sentence(error: Mapping[str, Any], who: str, allowed: Any, lengths: Mapping[tuple, int]) -> str:
    """The sentence of one mistake; `lengths` holds the right one of each list that is too short."""
    kind, where, value = error["type"], error["loc"], error["input"]
    key = ".".join(str(x) for x in where if not _of_pydantic(x))
    if kind == "extra_forbidden":
        known = f" Allowed: {choices(allowed)}." if len(where) == 1 and allowed else ""
        inside = "".join(f"{x}." for x in where[:-1] if not _of_pydantic(x))
        keys = [f"'{inside}{cut(x)}'" for x in error["keys"][:MOST_SENTENCES]]
        more = f" and {len(error['keys']) - len(keys)} others" if len(error["keys"]) > len(keys) else ""
        return f"{who}: unknown key{'s' if len(error['keys']) > 1 else ''} {', '.join(keys)}{more}.{known}"
    if kind == "missing" and where[:-1] in lengths:
        key = ".".join(str(x) for x in where[:-1])
        return f"{who}: {key} = {shown(value)}: Expected {lengths[where[:-1]]} items, got {len(value)}."
    if kind == "missing":
        return f"{who}: '{key}' is missing."
    if isinstance(error.get("ctx", {}).get("error"), DmsError):
        # A part with checks of its own (a path point, a signal) has named key and value already.
        said = " ".join(f"{line.rstrip('.')}." for line in error["msg"].removeprefix("Value error, ").splitlines())
        return f"{who}: {key}: {said}" if key else f"{who}: {said}"
    said = _right(kind, error.get("ctx", {}), error["msg"])
    return f"{who}: {key} = {shown(value)}: {said}" if key else f"{who}: {said}"


def _of_pydantic(place: Any) -> bool:
    """Whether a part of a mistake's place is pydantic's name of a type, where one of several was expected."""
    return isinstance(place, str) and bool(re.fullmatch(r"[a-z-]+\[.*\]|float|int|str|bool", place))


def shown(value: Any) -> str:
    """A value for a message, as Python writes it; only the beginning of a long one."""
    try:
        return cut(repr(plain(value)))
    except ValueError:  # Python refuses to write a whole number of more than 4300 digits
        return "a whole number of thousands of digits"


def cut(text: str, most: int = LONGEST) -> str:
    """A text on one line, or its beginning where it is longer than `most` characters."""
    text = printable(text[: most + 1])
    return text if len(text) <= most else f"{text[: most - 3]}..."


def _bounded(sentence: str) -> str:
    """A sentence, or both its ends: what is wrong stands at the beginning, what would be right at the end."""
    return both_ends("\n".join(map(printable, sentence.split("\n"))), LONGEST_SENTENCE)


def plain(value: Any) -> Any:
    """The value with numpy's numbers and arrays as Python's, which are printed without their types."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if type(value) in (list, tuple):
        return type(value)(plain(x) for x in value)
    if type(value) is dict:
        return {key: plain(x) for key, x in value.items()}
    return value


def _right(kind: str, context: Mapping[str, Any], message: str) -> str:
    """What would have been right."""
    if kind in ("too_short", "too_long"):
        limit = context["min_length"] if kind == "too_short" else context["max_length"]
        items = "item" if limit == 1 else "items"
        word = "at least" if kind == "too_short" else "at most"
        return f"Expected {word} {limit} {items}, got {context['actual_length']}."
    if kind in _EXPECTED:
        return f"Expected {_EXPECTED[kind].format(**context)}."
    # A check of ours speaks for itself; anything else is pydantic's wording, in our form.
    plain = message.removeprefix("Value error, ").removeprefix("Assertion failed, ").rstrip(".")
    return plain.replace("Input should be ", "Expected ") + "."

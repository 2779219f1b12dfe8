"""Values that a user gives, checked: what pydantic finds wrong, said in plain sentences.

Each sentence names the element, the key, the value and what would be right:

    rigid_body 'rod': mass = -1: Expected a number above 0.
    rigid_body 'rod': position = (0.0, 1.0): Expected 3 items, got 2.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from dms_core.errors import DmsError, InputError, choices

_EXPECTED: dict[str, str] = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
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


class Checked(BaseModel):
    """Base of everything that is checked: frozen, without unknown keys, without infinite numbers.

    A wrong value raises `wrong`, with one sentence for each mistake.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    wrong: ClassVar[type[DmsError]] = InputError

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            label = getattr(type(self), "kind", "") or type(self).__name__
            who = f"{label} '{data.get('name', '?')}'" if "name" in type(self).model_fields else label
            raise self.wrong(sentences(error, who, type(self).model_fields)) from None


def sentences(error: ValidationError, who: str, allowed: Any = ()) -> str:
    """What is wrong, one sentence a line.

    Args:
        error: what pydantic raised.
        who: what the values are for, such as "revolute 'elbow'".
        allowed: the keys that exist.
    """
    found, lengths = error.errors(), dict[tuple, int]()
    for e in found:
        if e["type"] == "missing" and e["loc"] and isinstance(e["loc"][-1], int):
            lengths[e["loc"][:-1]] = e["loc"][-1] + 1
    # Each missing item of a list is a mistake of its own to pydantic, but one to its author.
    return "\n".join(dict.fromkeys(_sentence(dict(e), who, allowed, lengths) for e in found))


def _sentence(error: Mapping[str, Any], who: str, allowed: Any, lengths: Mapping[tuple, int]) -> str:
    """The sentence of one mistake; `lengths` holds the right one of each list that is too short."""
    kind, where, value = error["type"], error["loc"], error["input"]
    key = ".".join(str(x) for x in where)
    if kind == "extra_forbidden":
        known = f" Allowed: {choices(allowed)}." if len(where) == 1 and allowed else ""
        return f"{who}: unknown key '{key}'.{known}"
    if kind == "missing" and where[:-1] in lengths:
        key = ".".join(str(x) for x in where[:-1])
        return f"{who}: {key} = {plain(value)!r}: Expected {lengths[where[:-1]]} items, got {len(value)}."
    if kind == "missing":
        return f"{who}: '{key}' is missing."
    if isinstance(error.get("ctx", {}).get("error"), DmsError):
        # A part with checks of its own (a path point, a signal) has named key and value already.
        said = f"{error['msg'].removeprefix('Value error, ').rstrip('.')}."
        return f"{who}: {key}: {said}" if key else f"{who}: {said}"
    said = _right(kind, error.get("ctx", {}), error["msg"])
    return f"{who}: {key} = {plain(value)!r}: {said}" if key else f"{who}: {said}"


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

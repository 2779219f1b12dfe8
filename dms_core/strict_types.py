"""Types of settings taken strictly: pydantic by itself takes '1.8' and true for numbers, and 'yes' and 1 for true."""

from __future__ import annotations

from typing import Any

from pydantic_core import PydanticKnownError, core_schema

_ASIDE = {"default", "metadata", "serialization", "expected", "ref"}
"""Parts of a schema that hold no schemas of values to be checked."""


def strict(schema: Any, owner: type) -> Any:
    """A schema of pydantic in which nothing but a number is a number, nothing but true and false a truth value.

    Args:
        schema: of a class, or a part of it.
        owner: the class; other ones within it have schemas of their own.
    """
    if isinstance(schema, list | tuple):
        return type(schema)(strict(part, owner) for part in schema)
    if not isinstance(schema, dict):
        return schema
    kind = schema.get("type")
    if kind == "model" and schema["cls"] is not owner:
        return schema
    if kind in ("float", "int"):
        refuse = _no_int if kind == "int" else _no_float
        return core_schema.no_info_before_validator_function(refuse, schema)
    if kind == "bool":
        return {**schema, "strict": True}
    return {key: part if key in _ASIDE else strict(part, owner) for key, part in schema.items()}


def _no_float(value: Any) -> Any:
    """Refuse what pydantic would take for a number beside numbers."""
    if isinstance(value, bool | str | bytes | bytearray):
        raise PydanticKnownError("float_type")
    return value


def _no_int(value: Any) -> Any:
    """Refuse what pydantic would take for a whole number beside numbers."""
    if isinstance(value, bool | str | bytes | bytearray):
        raise PydanticKnownError("int_type")
    return value

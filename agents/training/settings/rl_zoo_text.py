"""Values that rl_zoo3 writes as Python text, "dict(net_arch=[64], activation_fn=nn.Tanh)", read without running it.

rl_zoo3 evaluates such text, so a file from elsewhere could do anything. Here only literals, `dict(...)` and dotted
names are taken; a name stays a name, and who uses it has a list of the names it knows.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import Any

from dms_core.errors import InputError
from dms_core.validation import cut, shown

LONGEST = 2000
"""Characters of such a text; Python's parser may take deep nesting of longer ones for the end of its stack."""


class Name(str):
    """A dotted name that stood without quotes."""

    def __repr__(self) -> str:
        """As it stood."""
        return str(self)


def read_call(text: str) -> dict[str, Any]:
    """The mapping that `dict(...)` or `{...}` stands for.

    Raises:
        InputError: the text is something else; names the part.
    """
    expected = "expected dict(key=value, ...) with plain values"
    if len(text) > LONGEST:
        raise InputError(f"{shown(text)} has {len(text)} characters: {expected}, at most {LONGEST} characters.")
    try:
        mapping = _value(ast.parse(text.strip(), mode="eval").body)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise InputError(f"{shown(text)} is not a mapping ({cut(str(error))}): {expected}.") from None
    if not isinstance(mapping, dict):
        raise InputError(f"{shown(text)} is a {type(mapping).__name__}: {expected}.")
    return mapping


def write_call(values: Mapping[str, Any]) -> str:
    """The text of a mapping with names as keys."""
    return f"dict({', '.join(f'{key}={plain(value)!r}' for key, value in values.items())})"


def _value(node: ast.expr) -> Any:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "dict" and not node.args:
        if any(k.arg is None for k in node.keywords):
            raise ValueError("'**' is not plain")
        return _mapping([(str(k.arg), _value(k.value)) for k in node.keywords])
    if isinstance(node, ast.Name | ast.Attribute):
        return Name(_dotted(node))
    if isinstance(node, ast.List | ast.Tuple):
        items = [_value(e) for e in node.elts]
        return items if isinstance(node, ast.List) else tuple(items)
    if isinstance(node, ast.Dict):
        return _mapping([(_key(k), _value(v)) for k, v in zip(node.keys, node.values, strict=True)])
    found = ast.literal_eval(node)
    if not isinstance(found, bool | int | float | str | None):
        raise ValueError(f"a {type(found).__name__} is not plain")
    return found


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A mapping whose keys stand once."""
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [key for key, _ in pairs]
        raise ValueError(f"the key '{next(key for key in names if names.count(key) > 1)}' stands twice")
    return found


def _key(node: ast.expr | None) -> str:
    if not isinstance(node, ast.Constant) or not isinstance(node.value, str):
        raise ValueError("a key is not text")
    return node.value


def _dotted(node: ast.expr) -> str:
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        return f"{_dotted(node.value)}.{node.attr}"
    raise ValueError(f"'{ast.unparse(node)}' is not a plain name")


def plain(value: Any) -> Any:
    """Plain dicts and lists, whose text Python reads; file sections are not."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list):
        return [plain(v) for v in value]
    return value

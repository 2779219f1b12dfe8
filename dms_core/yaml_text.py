"""Reading YAML so that a mistake can be shown by file and line.

Safe loading (no objects are built), with three differences from `yaml.safe_load`, each because the usual rule hides
a mistake: a key that stands twice is an error; `1e-5` is a number (YAML 1.2; YAML 1.1 reads it as text); `yes`, `on`
and the like are text, only `true` and `false` are logical.
"""

from __future__ import annotations

import copy
import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from dms_core.errors import InputError


class Section(dict):
    """A mapping of a file that knows its line, counted from 1."""

    line: int = 0


class _Loader(yaml.SafeLoader):
    """Safe loader of `Section`s."""

    yaml_implicit_resolvers = {
        first: [(tag, pattern) for tag, pattern in rules if not tag.endswith((":bool", ":float"))]
        for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def section(self, node: yaml.MappingNode) -> Section:
        self.flatten_mapping(node)
        found = Section()
        found.line = node.start_mark.line + 1
        for key_node, value_node in node.value:
            key = self.construct_object(key_node, deep=True)
            where = key_node.start_mark
            if not isinstance(key, str):
                raise yaml.MarkedYAMLError(problem=f"the key {key!r} is not text", problem_mark=where)
            if key in found:
                raise yaml.MarkedYAMLError(problem=f"the key '{key}' stands twice", problem_mark=where)
            found[key] = self.construct_object(value_node, deep=True)
        return found


_Loader.add_constructor("tag:yaml.org,2002:map", _Loader.section)
_Loader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile(r"^(?:true|True|false|False)$"), list("tTfF"))
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"^[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))(?:[eE][-+]?[0-9]+)?$|^[-+]?\.(?:inf|Inf)$|^\.(?:nan|NaN)$"
    ),
    list("-+0123456789."),
)


def read_yaml(path: str | Path) -> Section:
    """The mapping that a YAML file holds.

    Raises:
        InputError: the file cannot be read, is not YAML, or holds no mapping; names file and line.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(f"file '{path}' cannot be read: {reason}.") from None
    try:
        # What is handed out is the caller's to change.
        found = copy.deepcopy(_parsed(text))
    except yaml.YAMLError as error:
        raise InputError(_sentence(path, error)) from None
    if not isinstance(found, Section):
        what = "nothing" if found is None else f"a {type(found).__name__}"
        raise InputError(f"file '{path}' holds {what}. Expected a mapping of keys to values.")
    return found


@lru_cache(maxsize=64)
def _parsed(text: str) -> Any:
    """What a text stands for; kept, since environments of a batch read the same files."""
    return yaml.load(text, Loader=_Loader)


def read_value(text: str) -> Any:
    """What a text stands for by the same rules: '1e-3' is a number, '[64, 64]' a list, 'lin_1e-3' text.

    Raises:
        InputError: the text is not YAML.
    """
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise InputError(f"value {text!r} is not valid YAML: {getattr(error, 'problem', None) or error}.") from None


def _sentence(path: Path, error: yaml.YAMLError) -> str:
    """Which line is wrong and why."""
    mark = getattr(error, "problem_mark", None)
    where = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
    parts = [p for p in (getattr(error, "context", None), getattr(error, "problem", None)) if p]
    return f"file '{path}'{where} is not valid YAML: {'; '.join(parts) or error}."

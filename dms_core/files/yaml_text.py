"""Reading YAML so that a mistake can be shown by file and line.

All files are read alike: models, patients, devices, subjects, exercises, scenarios, and what stands behind `--set`.
Numbers are those of YAML 1.2 (yaml_scalars.py). A key that stands twice is an error. A merge (`<<: *rod`) gives keys
that its mapping does not give itself, and of several merged mappings the first that has a key gives it. No objects are
built. A text is read in bounded time and memory, whatever stands in it.

Files that rl_zoo3 reads too are `portable`: a scalar that YAML 1.1 reads otherwise is an error there.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from dms_core.errors import InputError
from dms_core.files.input_file import MOST_BYTES, decoded, read_bytes
from dms_core.files.yaml_builder import FAST, Builder, Refused, Section, copied
from dms_core.files.yaml_scalars import NUMBER, STANDARD, UNPRINTABLE
from dms_core.validation import shown

MOST_PORTABLE = 100_000
"""Largest file that is read by PyYAML's own parser, as rl_zoo3 does [bytes]; it takes up to 10 s for a megabyte."""
MOST_DIRECTIVES = 100
"""Most lines that begin with %: libyaml compares each %TAG with all others."""
SHORT = 20_000
"""Longest text of which the content is kept [characters]."""


def read_yaml(path: str | Path, *, portable: bool = False) -> Section:
    """The mapping that a YAML file holds.

    Args:
        path: a regular file in UTF-8.
        portable: refuse scalars that YAML 1.1 reads otherwise, for files that rl_zoo3 reads too.

    Raises:
        InputError: the file cannot be read, is not YAML, or holds no mapping; names file and line.
    """
    slow = portable or FAST is yaml.SafeLoader
    content = read_bytes(path, MOST_PORTABLE if slow else MOST_BYTES)
    return parse_yaml(decoded(path, content), path, portable=portable)


@contextmanager
def said_of(path: str | Path) -> Iterator[None]:
    """Name the file in an InputError about what it holds, where the error does not."""
    try:
        yield
    except InputError as error:
        raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from None


def parse_yaml(text: str, path: str | Path, *, portable: bool = False) -> Section:
    """The mapping that the text of a file stands for, see `read_yaml`; the caller's to change.

    Raises:
        InputError: the text is not YAML or no mapping; names file and line.
    """
    try:
        found = copied(_kept(text, portable)) if len(text) <= SHORT else _parsed(text, portable)
    except yaml.YAMLError as error:
        raise InputError(_sentence(f"file '{path}'", error, text)) from None
    if not isinstance(found, Section):
        what = "nothing" if found is None else f"a {type(found).__name__}"
        raise InputError(f"file '{path}' holds {what}. Expected a mapping of keys to values.")
    return found


def read_value(text: str) -> Any:
    """What a text stands for by the same rules: '1e-3' is a number, '[64, 64]' a list, 'lin_1e-3' text.

    Raises:
        InputError: the text is not YAML.
    """
    try:
        return _parsed(text, False)
    except yaml.YAMLError as error:
        raise InputError(_sentence(f"value {shown(text)}", error, text, place=False)) from None


def yaml_of(content: Any, **layout: Any) -> str:
    """The text that `read_yaml` and readers of YAML 1.1 read back as it was.

    Args:
        content: mappings, lists and scalars.
        layout: arguments of `yaml.dump`.
    """
    return yaml.dump(content, Dumper=_Dumper, sort_keys=False, width=120, **layout)


class _Dumper(yaml.SafeDumper):
    """Puts texts into quotes that are numbers in YAML 1.2, such as '1e5', beside those that are numbers in 1.1."""


_Dumper.add_implicit_resolver(f"{STANDARD}float", NUMBER, list("-+.0123456789"))


@lru_cache(maxsize=64)
def _kept(text: str, portable: bool) -> Any:
    """What a short text stands for; kept, since environments of a batch read the same files."""
    return _parsed(text, portable)


def _parsed(text: str, portable: bool) -> Any:
    """What a text stands for."""
    found = UNPRINTABLE.search(text)
    if found and not (found[0] == "\ufeff" and found.start() == 0):
        before = text[: found.start()]
        line, column = before.count("\n"), found.start() - before.rfind("\n") - 1
        mark: Any = yaml.Mark("", found.start(), line, column, "", 0)
        raise Refused(problem=f"the character {found[0]!r} is not allowed", problem_mark=mark)
    if sum(line.startswith("%") for line in text.splitlines()) > MOST_DIRECTIVES:
        raise Refused(problem=f"more than {MOST_DIRECTIVES} lines begin with %, as directives do")
    try:
        return Builder(text, portable).document()
    except (ValueError, OverflowError) as error:  # numbers of escapes and directives that PyYAML does not check
        raise yaml.YAMLError(str(error)) from None


def _sentence(what: str, error: yaml.YAMLError, text: str, place: bool = True) -> str:
    """What is wrong, and in which line where there are several."""
    mark = getattr(error, "problem_mark", None)
    where = f", line {mark.line + 1}, column {mark.column + 1}" if mark and place else ""
    parts = [p for p in (getattr(error, "context", None), getattr(error, "problem", None)) if p]
    if isinstance(error, Refused):
        return f"{what}{where}: {'; '.join(parts)}."
    if mark and "cannot start any token" in parts[-1]:
        lines = re.split("\r\n|[\n\r\x85\u2028\u2029]", text)
        character = "".join(lines[mark.line : mark.line + 1])[mark.column : mark.column + 1]
        parts = ["a tab '\\t' stands where only spaces may" if character == "\t" else
                 f"no value begins with {character!r}; put it in quotes if it is text"]  # fmt: skip
    return f"{what}{where} is not valid YAML: {'; '.join(parts) or ' '.join(str(error).split())}."

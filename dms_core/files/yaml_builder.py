"""What the events of PyYAML's parser stand for: sections, lists and scalars, in bounded time and memory.

The parser does not descend into what it reads and so needs no stack; what is built of its events is counted, so that
neither depth nor aliases of aliases can use up the machine.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import yaml

from dms_core.files.yaml_scalars import STANDARD, TAGS, UNPRINTABLE, OlderReader, plain_scalar, tagged_scalar
from dms_core.validation import shown

MOST_VALUES = 100_000
"""Most keys and values in a text, those that aliases stand for included."""
MOST_DEPTH = 50
"""Most lists and mappings within each other."""
MOST_CHARACTERS, LONGEST_KEY = 10_000, 200
"""Longest value and longest key [characters]."""
FAST = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""Parser of all files but portable ones; libyaml's, with which PyYAML is built almost everywhere, takes a twentieth of
the time of PyYAML's own."""


class Section(dict):
    """A mapping of a file that knows its line, counted from 1."""

    line: int = 0


class Refused(yaml.MarkedYAMLError):
    """Valid YAML that is not taken."""


def refused(problem: str, event: Any) -> Refused:
    """The refusal of what begins with an event."""
    return Refused(problem=problem, problem_mark=event.start_mark)


def copied(value: Any) -> Any:
    """A copy of sections and lists, and of those in them."""
    if isinstance(value, Section):
        found = Section((key, copied(x)) for key, x in value.items())
        found.line = value.line
        return found
    return [copied(x) for x in value] if isinstance(value, list) else value


class Builder:
    """Makes values of the events of PyYAML's parser, which does not descend into what it reads and so needs no stack.

    Args:
        text: one document.
        portable: see `read_yaml`.
    """

    def __init__(self, text: str, portable: bool) -> None:
        self._events: Iterator[Any] = yaml.parse(text, Loader=yaml.SafeLoader if portable else FAST)
        self._older = OlderReader() if portable else None
        self._anchors: dict[str, tuple[Any, int] | None] = {}
        self._count = 0

    def document(self) -> Any:
        """The value of the only document, None where there is none."""
        next(self._events)  # start of the stream
        start = next(self._events)
        if isinstance(start, yaml.StreamEndEvent):
            return None
        if start.version == (1, 1) and self._older is None:
            raise refused("'%YAML 1.1' asks for another version than 1.2", start)
        found = self._value(next(self._events), 0)
        next(self._events)  # end of the document
        after = next(self._events)
        if not isinstance(after, yaml.StreamEndEvent):
            raise refused("a second document begins; expected one", after)
        return found

    def _value(self, event: Any, depth: int) -> Any:
        """The value that an event begins."""
        if isinstance(event, yaml.AliasEvent):
            return self._alias(event)
        if isinstance(event, yaml.ScalarEvent) and len(event.value) > MOST_CHARACTERS:
            raise refused(f"a value has {len(event.value)} characters; expected at most {MOST_CHARACTERS}", event)
        before = self._count
        # A text counts by its length too: aliases of a long one add up to more than the machine holds.
        self._counted(1 + len(event.value) // 50 if isinstance(event, yaml.ScalarEvent) else 1, event)
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        if isinstance(event, yaml.ScalarEvent):
            found = self._scalar(event)
        else:
            if depth == MOST_DEPTH:
                raise refused(f"more than {MOST_DEPTH} lists and mappings stand within each other", event)
            _check_tag(event, ("seq",) if isinstance(event, yaml.SequenceStartEvent) else ("map",))
            found = (self._list if isinstance(event, yaml.SequenceStartEvent) else self._section)(event, depth + 1)
        if event.anchor is not None:
            self._anchors[event.anchor] = found, self._count - before
        return found

    def _alias(self, event: Any) -> Any:
        """A copy of what an alias stands for; what it holds counts again."""
        if event.anchor not in self._anchors:
            raise refused(f"the alias *{event.anchor} has no anchor", event)
        known = self._anchors[event.anchor]
        if known is None:
            raise refused(f"the alias *{event.anchor} stands within its own anchor", event)
        found, count = known
        self._counted(count, event)
        return copied(found)

    def _list(self, start: Any, depth: int) -> list[Any]:
        """The items up to the end of a list."""
        found = []
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            found.append(self._value(event, depth))
        return found

    def _section(self, start: Any, depth: int) -> Section:
        """The keys and values up to the end of a mapping."""
        found, merged = Section(), None
        found.line = start.start_mark.line + 1
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            if _is_merge(event):
                if merged is not None:
                    raise refused("the merge key << stands twice; write <<: [*first, *second]", event)
                merged = _merged(self._value(next(self._events), depth), event)
                continue
            key = self._key(event, depth)
            if key in found:
                raise refused(f"the key '{key}' stands twice", event)
            found[key] = self._value(next(self._events), depth)
        if merged is not None:
            merged.update(found)
            merged.line = found.line
            return merged
        return found

    def _key(self, event: Any, depth: int) -> str:
        """A key, which is text."""
        if isinstance(event, yaml.CollectionStartEvent):
            kind = "list" if isinstance(event, yaml.SequenceStartEvent) else "mapping"
            raise refused(f"a {kind} stands where a key is expected", event)
        key = self._value(event, depth)
        if not isinstance(key, str):
            raise refused(f"the key {shown(key)} is not text", event)
        if len(key) > LONGEST_KEY:
            raise refused(f"the key {shown(key)} has {len(key)} characters; expected at most {LONGEST_KEY}", event)
        if not key.isprintable():
            raise refused(f"the key {shown(key)} holds characters that are not printed", event)
        return key

    def _scalar(self, event: Any) -> Any:
        """A text, number, truth value or null."""
        text, tag = event.value, event.tag
        if not event.implicit[0] and (found := UNPRINTABLE.search(text)):
            raise refused(f"the character {found[0]!r} is not allowed", event)
        _check_tag(event, TAGS)
        try:
            if tag is None:
                value = plain_scalar(text) if event.implicit[0] else text
            else:
                value = tagged_scalar(tag.removeprefix(STANDARD) if tag != "!" else "str", text)
        except ValueError as error:
            raise refused(f"{shown(text)} is not taken: {error}", event) from None
        if self._older is not None:
            said = self._older.difference(text, tag, event.implicit, value)
            if said is not None:
                raise refused(said, event)
        return value

    def _counted(self, more: int, event: Any) -> None:
        """Refuse a text that holds too much."""
        self._count += more
        if self._count > MOST_VALUES:
            raise refused(f"more than {MOST_VALUES} keys and values stand here, aliases written out", event)


def _is_merge(event: Any) -> bool:
    """Whether a key is `<<`, without quotes."""
    return isinstance(event, yaml.ScalarEvent) and event.value == "<<" and event.tag is None and event.implicit[0]


def _merged(given: Any, event: Any) -> Section:
    """What a merge gives: one mapping, or the first of several that has a key."""
    found = Section()
    for one in reversed(given if isinstance(given, list) else [given]):
        if not isinstance(one, Section):
            raise refused(f"<<: {shown(given)}: expected a mapping or a list of mappings", event)
        found.update(one)
    return found


def _check_tag(event: Any, known: tuple[str, ...]) -> None:
    """Refuse a tag that stands for no plain value."""
    if event.tag not in (None, "!", *(f"{STANDARD}{kind}" for kind in known)):
        tag = event.tag.replace(STANDARD, "!!")
        right = " or ".join(f"!!{kind}" for kind in known)
        raise refused(f"the tag {shown(tag)} is not read here; expected none, or {right}", event)

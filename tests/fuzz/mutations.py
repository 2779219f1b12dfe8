"""Hostile texts that grow from files that are shipped: bytes, tokens and the structure are changed."""

from __future__ import annotations

import copy
import re

import yaml
from hypothesis import strategies as st

TOKEN = re.compile(r"\s+|[\[\]{}:,&*#'\"|>!%@`?-]|[^\s\[\]{}:,&*#'\"|>!%@`?-]+")
TOKENS = [
    "010", "0o10", "0x1F", "1:30", "1_000", "1e5", "1e400", "-1", "0", ".5", "+1", "1" * 30, "9" * 400, "1" * 5000,
    ".nan", ".inf", "-.inf", "true", "yes", "null", "~", "'1.8'", '"x"', "'", '"', "2020-01-01", "=", "<<", "<<: *a",
    "&a ", "*a", "&a [*a]", "*nowhere", "!!binary x", "!!python/object:os.system ", "!!float ", "!!set ", "!x ", "! ",
    "[", "]", "{", "}", "[" * 60, "- " * 60, "{a: " * 60, "? ", ": ", ", ", "- ", "\n", "\r\n", "\r", "\t", "\n\t",
    "---\n", "\n---\n", "...\n", "%YAML 1.1\n---\n", "%TAG ! x\n---\n", "#", "|", ">-\n", "@", "`", "\x00", "\ufeff",
    '"\\0"', '"\\ud800"', '"\\UFFFFFFFF"', "\u2028", "\x85", "é", "𝕏", "k" * 300, "x" * 11000, "a: b: c", "self",
    "name", "kind", "ground", "fields", "dict(a=1)", "dict(", "__class__",
]  # fmt: skip
"""What may stand in place of a token, or between two."""
VALUES = [
    None, True, False, 0, -1, 1, 3, 10, 0.5, -2.5, 1e-300, 1e300, float("inf"), float("-inf"), float("nan"),
    10**30, 10**299,
    "", "x", "1.8", "true", "ground", "é\n", "x" * 500, [], {}, [1], [[]], [None], [0.0, 0.0, 0.0], [1.0] * 500,
    [True, 1, 2], ["1", 2, 3], [float("nan")] * 3, {"a": 1}, {"kind": "gravity"}, {"kind": []}, {"uniform": [0, 1]},
    {"name": "x"}, {"self": 1}, {"cls": 1}, {f"k{i}": i for i in range(300)},
]  # fmt: skip
"""What may stand in place of a value."""


def mutated(seeds: list[str]) -> st.SearchStrategy[bytes]:
    """Contents of files, each grown from one of the seeds."""
    return st.one_of(_bytes(seeds), _tokens(seeds), _structure(seeds))


@st.composite
def _bytes(draw, seeds: list[str]) -> bytes:
    content = draw(st.sampled_from(seeds)).encode()
    for _ in range(draw(st.integers(1, 4))):
        a = draw(st.integers(0, len(content)))
        b = min(len(content), a + draw(st.integers(0, 40)))
        what = draw(st.sampled_from(("delete", "insert", "double", "end", "replace")))
        new = draw(st.binary(max_size=6)) if what in ("insert", "replace") else b""
        content = {
            "delete": content[:a] + content[b:], "insert": content[:a] + new + content[a:],
            "double": content[:b] + content[a:], "end": content[:a], "replace": content[:a] + new + content[b:],
        }[what]  # fmt: skip
    return content


@st.composite
def _tokens(draw, seeds: list[str]) -> bytes:
    tokens = TOKEN.findall(draw(st.sampled_from(seeds)))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(tokens)))
        what = draw(st.sampled_from(("delete", "insert", "replace", "swap")))
        other = tokens[draw(st.integers(0, len(tokens) - 1))] if tokens and what == "swap" else ""
        new = draw(st.sampled_from(TOKENS)) if what in ("insert", "replace") else other
        tokens[at : at + (what != "insert")] = [new] if new else []
    return "".join(tokens).encode("utf-8", "surrogatepass")


@st.composite
def _structure(draw, seeds: list[str]) -> bytes:
    content = copy.deepcopy(yaml.safe_load(draw(st.sampled_from(seeds))))
    for _ in range(draw(st.integers(1, 3))):
        place = content
        while True:
            keys = list(place) if isinstance(place, dict) else list(range(len(place)))
            if not keys:
                break
            key = draw(st.sampled_from(keys))
            below = place[key]
            if isinstance(below, dict | list) and below and draw(st.integers(0, 3)):
                place = below
                continue
            what = draw(st.sampled_from(("value", "value", "value", "delete", "key")))
            if what == "value":
                place[key] = copy.deepcopy(draw(st.sampled_from(VALUES)))
            elif what == "delete":
                del place[key]
            elif isinstance(place, dict):
                place[draw(st.sampled_from(["", "x", "self", "name", "kind", "1", "k" * 150]))] = below
            break
    return yaml.safe_dump(content, default_flow_style=draw(st.sampled_from((None, False, True)))).encode()

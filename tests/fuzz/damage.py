"""Damage to files: of bytes, of tokens and of structure, grown from a whole file that is given."""

import copy
import json
import re
import time

import pytest
from hypothesis import strategies as st

from dms_core.errors import DmsError

SECONDS, LONGEST = 2.0, 400
"""What a reader may take on the processor, and characters of what it says."""
TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|-?[0-9][0-9.eE+-]*|true|false|null|[][{}:,]')
TOKENS = (
    "NaN", "-Infinity", "1e400", "-1", "0", "1.5", "1000000000", "1" * 30, "1" * 5000, "null", "true", '"x"', '""',
    '"\\ud800"', '"\\u0000"', "[]", "{}", "[[[[1]]]]", "[" * 3000, "]", "{", ",", ":", '"a":1,', "'", "\ufeff", "é",
)  # fmt: skip
VALUES = (
    None, True, False, 0, -1, 1, 2, 1.5, -0.0, 1e308, 10**9, 10**18, 10**40, "", "x", "1", "nan", "\x00\n", "../../x",
    "é" * 500, "os:x", [], {}, [None], [[[[[]]]]], {"x": 1}, {"self": 1}, {"": {}}, [0] * 2000, "y" * 20_000,
)  # fmt: skip
BYTES = (b"", b"\x00", b"\xff" * 8, b"\xfe\xff", b"\n", b'"', b"{", b"\x80\x04.", b"0" * 40)
# Hypothesis likes 0 and other ends of a range, where files are headers: a product scatters what it draws.
PLACES = st.integers(0, 10**6).map(lambda k: (k * 617_189 + 271_828) % 10**6)
"""A place in a file, in millionths of its length."""


def steps(choices):
    """Some changes, each a place, an extent and what is put there."""
    extents = st.integers(0, 38).map(lambda k: k * 5 % 13)
    return st.lists(st.tuples(PLACES, extents, st.sampled_from(choices)), min_size=1, max_size=3)


def of_bytes(content: bytes):
    """Files with parts cut out, put in, written over, or cut off."""

    def changed(changes, cut):
        found = content
        for place, extent, new in changes:
            k = place * len(found) // 10**6
            found = found[:k] + new + found[k + extent :]
        return found[: cut * len(found) // 10**6] if cut % 4 == 0 else found

    return st.builds(changed, steps(BYTES), PLACES)


def of_tokens(text: str):
    """JSON texts with other tokens."""
    tokens = TOKEN.findall(text)

    def changed(changes):
        found = list(tokens)
        for place, extent, new in changes:
            k = place * len(found) // 10**6
            if extent > 8:  # what was there stands twice
                found.insert(k, found[min(k, len(found) - 1)])
            else:
                found[k : k + max(extent - 4, 1)] = [new]
        return " ".join(found).encode("utf-8", "surrogatepass")

    return st.builds(changed, steps(TOKENS))


def of_structure(content):
    """What a JSON file holds, with other values, keys and lengths at any depth."""

    def changed(changes):
        found = [copy.deepcopy(content)]
        for place, extent, new in changes:
            # The first slot is the whole content, which is seldom replaced.
            slots = list(_slots(found))[place % 20 > 0 :] or list(_slots(found))
            holder, key = slots[place * len(slots) // 10**6]
            if extent < 7:
                holder[key] = copy.deepcopy(new)
            elif extent < 9:
                holder.pop(key)
            elif extent < 11 and isinstance(holder, list):
                holder.insert(key, holder[key])
            else:
                holder[key] = [holder[key]] if extent == 11 else {"x": holder[key]}
            if not found:
                found = [None]
        return found[0]

    return st.builds(changed, steps(VALUES))


def of_json(text: str, whole=lambda content: content):
    """JSON files, damaged in all three ways; `whole` mends what a reader would refuse before all else."""
    structured = of_structure(json.loads(text)).map(lambda content: json.dumps(whole(content)).encode())
    return st.one_of(structured, structured, of_tokens(text), of_bytes(text.encode()))


def _slots(holder):
    """Every place where a value stands."""
    pairs = list(holder.items() if isinstance(holder, dict) else enumerate(holder))
    for key, value in pairs:
        yield holder, key
        if isinstance(value, dict | list):
            yield from _slots(value)


def is_read_or_refused(read, *arguments):
    """What a reader gives, or None where it refuses in one short sentence; in no time in either case."""
    before = time.process_time()
    try:
        found = read(*arguments)
    except DmsError as error:
        said, found = str(error), None
        # The path of the test's folder is no part of what is bounded.
        said = re.sub(r"'/[^']*'", "'FILE'", said)
        assert said and len(said) <= LONGEST and "\n" not in said and said.isprintable(), said[:2000]
        assert not re.search(r"<(class|function|object)|Traceback|pydantic", said), said
    except Exception as error:
        pytest.fail(f"{type(error).__name__}: {error}"[:500])
    assert time.process_time() - before < SECONDS
    return found

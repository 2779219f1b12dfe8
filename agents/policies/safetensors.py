"""Reading and writing the safetensors format (https://github.com/huggingface/safetensors): arrays without pickles.

Eight bytes with the length of a JSON header, the header (type, shape and place of each array), the numbers, little
endian, row by row.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import FailFast, Field

from dms_core.errors import InputError
from dms_core.files.json_text import brief, checked, parse_json
from dms_core.validation import Checked

TYPES = {"F64": "<f8", "F32": "<f4", "I64": "<i8", "U8": "|u1"}
NAMES = {np.dtype(code): name for name, code in TYPES.items()}
LONGEST_HEADER = 1_000_000
"""[byte]; a header that claims more is no header."""
Whole = Annotated[int, Field(strict=True, ge=0, le=1 << 40)]
"""A size or a place, which no file of numbers exceeds."""


def to_bytes(arrays: Mapping[str, np.ndarray]) -> bytes:
    """A file's content, arrays in the order of their names."""
    header, parts, place = {}, [], 0
    for name in sorted(arrays):
        array = np.asarray(arrays[name], order="C")
        data = array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes()
        span = [place, place + len(data)]
        header[name] = {"dtype": NAMES[array.dtype], "shape": list(array.shape), "data_offsets": span}
        parts.append(data)
        place = span[1]
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + b"".join(parts)


class Entry(Checked):
    """What a header says of an array."""

    dtype: Literal["F64", "F32", "I64", "U8"]
    shape: Annotated[tuple[Whole, ...], FailFast()] = Field(max_length=8)
    data_offsets: tuple[Whole, Whole]


def from_bytes(content: bytes, where: str | Path) -> dict[str, np.ndarray]:
    """The arrays of a file's content.

    Raises:
        InputError: the content is cut off, contradicts itself or is something else; names the file.
    """
    try:
        return _arrays(content)
    except InputError as error:
        raise InputError(f"file '{where}' holds no whole safetensors: {brief(str(error))}") from None


def _arrays(content: bytes) -> dict[str, np.ndarray]:
    if len(content) < 8:
        raise InputError("it is cut off.")
    (length,) = struct.unpack_from("<Q", content)
    if length > LONGEST_HEADER:
        raise InputError(f"the header claims {length} bytes: expected at most {LONGEST_HEADER}.")
    if length > len(content) - 8:
        raise InputError("it is cut off.")
    try:
        text = content[8 : 8 + length].decode()
    except UnicodeDecodeError:
        raise InputError("the header is not UTF-8 text.") from None
    header = parse_json(text, "the header")
    if not isinstance(header, dict):
        raise InputError("the header is no mapping of keys to values.")
    header.pop("__metadata__", None)
    entries = {name: checked(Entry, one, f"array '{brief(name, 60)}'") for name, one in header.items()}
    numbers, end = memoryview(content)[8 + length :], 0
    # Every byte belongs to one array, as the format has it: else arrays could share numbers, or hide some.
    for name, one in sorted(entries.items(), key=lambda item: item[1].data_offsets):
        size = np.dtype(TYPES[one.dtype]).itemsize * math.prod(one.shape)
        if one.data_offsets != (end, end + size):
            raise InputError(
                f"array '{brief(name, 60)}' stands at bytes {one.data_offsets}: expected {(end, end + size)}."
            )
        end += size
    if end != len(numbers):
        raise InputError(f"it is cut off: {len(numbers)} bytes of numbers, expected {end}.")
    return {name: _array(one, numbers) for name, one in entries.items()}


def _array(entry: Entry, numbers: memoryview) -> np.ndarray:
    begin, end = entry.data_offsets
    return np.frombuffer(numbers[begin:end], dtype=TYPES[entry.dtype]).reshape(entry.shape).copy()

"""Reading and writing the safetensors format (https://github.com/huggingface/safetensors): arrays without pickles.

Eight bytes with the length of a JSON header, the header (type, shape and place of each array), the numbers, little
endian, row by row.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dms_core.errors import InputError

TYPES = {"F64": "<f8", "F32": "<f4", "I64": "<i8", "U8": "|u1"}
NAMES = {np.dtype(code): name for name, code in TYPES.items()}
LONGEST_HEADER = 1_000_000
"""[byte]; a header that claims more is no header."""


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


def from_bytes(content: bytes, where: str | Path) -> dict[str, np.ndarray]:
    """The arrays of a file's content.

    Raises:
        InputError: the content is cut off or something else; names the file.
    """
    try:
        (length,) = struct.unpack_from("<Q", content)
        if length > LONGEST_HEADER:
            raise ValueError("the header is too long")
        header, numbers = json.loads(content[8 : 8 + length]), memoryview(content)[8 + length :]
        return {name: _array(entry, numbers) for name, entry in header.items() if name != "__metadata__"}
    except (struct.error, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"file '{where}' holds no whole safetensors: {error}.") from None


def _array(entry: Mapping, numbers: memoryview) -> np.ndarray:
    begin, end = entry["data_offsets"]
    if not 0 <= begin <= end <= len(numbers):
        raise ValueError("it is cut off")
    return np.frombuffer(numbers[begin:end], dtype=TYPES[entry["dtype"]]).reshape(entry["shape"]).copy()

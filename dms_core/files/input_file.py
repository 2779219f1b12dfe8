"""Text files that a user gives: taken only if they are regular files of a size that can be read in no time."""

from __future__ import annotations

import hashlib
import stat
from pathlib import Path
from typing import BinaryIO

from dms_core.errors import InputError

MOST_BYTES = 4_000_000
"""Largest file of settings [bytes]; a model of a thousand bodies has a tenth of it."""
BLOCK = 1 << 20
"""Read at once [bytes]."""
_KINDS = ((stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"),
          (stat.S_ISSOCK, "a socket"))  # fmt: skip
_OTHER_ENCODINGS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}


def read_bytes(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """Contents of a file.

    Args:
        path: a regular file, or a link to one; a pipe or a device may never end.
        most: largest size that is taken [bytes].

    Raises:
        InputError: it is something else, too large, or cannot be read; names the file.
    """
    path = Path(path)
    try:
        found = path.stat()
        for is_kind, what in _KINDS:
            if is_kind(found.st_mode):
                raise InputError(f"file '{path}' cannot be read: it is {what}. Expected a regular file.")
        # A file of /proc says that it is empty, and another may grow meanwhile: what counts is what is read.
        with path.open("rb") as file:
            content = file.read(most + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"file '{path}' cannot be read: {reason}.") from None
    if len(content) > most:
        raise InputError(
            f"file '{path}' cannot be read: it has more than {most / 1e6:g} MB, and nothing larger is taken."
        )
    return content


def decoded(path: str | Path, content: bytes) -> str:
    """The text of a file; a byte order mark in front of it, which some editors write, is no part of it.

    Raises:
        InputError: it is not UTF-8; names the file and the encoding where that is known.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        other = _OTHER_ENCODINGS.get(content[:2])
        what = f"it is {other} text" if other else f"it is not UTF-8 text (byte {error.start + 1})"
        raise InputError(f"file '{path}' cannot be read: {what}. Save it as UTF-8.") from None


def opened(path: Path) -> BinaryIO:
    """A regular file of any size, to read; a pipe or a device might never end.

    Raises:
        InputError: it is missing, something else, or cannot be read; names it.
    """
    if path.exists() and not path.is_file():
        raise InputError(f"file '{path}' cannot be read: expected a regular file.")
    try:
        return path.open("rb")
    except OSError as error:
        raise InputError(f"file '{path}' cannot be read: {error.strerror}.") from None


def digest(path: Path) -> str:
    """SHA-256 of a regular file.

    Raises:
        InputError: it cannot be read; names it.
    """
    hashed = hashlib.sha256()
    with opened(path) as file:
        while block := file.read(BLOCK):
            hashed.update(block)
    return hashed.hexdigest()

"""Writing results whole or not at all: the place is tried before a run, and a file appears only when it is complete."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from dms_core.errors import InputError

DIGITS = ".12g"
"""Format of numbers in tables: more digits than any tolerance in use, fewer than rounding shows."""


def check_writable(path: str | Path) -> Path:
    """The path, if a file can be written there; missing folders are made. Call it before a long run.

    Raises:
        InputError: names the folder and the reason.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"output '{path}' is a folder; give the name of a file in it.")
    if path.parent.exists() and not path.parent.is_dir():
        raise InputError(f"output '{path}': '{path.parent}' is a file, not a folder; choose another place.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Permission bits tell root nothing and network drives lie; only writing shows that writing works.
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise InputError(
            f"output '{path}': the folder '{path.parent}' cannot be written ({error.strerror}); choose another place."
        ) from None
    return path


@contextlib.contextmanager
def whole_file(path: str | Path) -> Iterator[IO[str]]:
    """A text file that takes its name only when the block ends without an exception.

    Raises:
        InputError: the folder cannot be written.
    """
    path = check_writable(path)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", text=True)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as file:
            yield file
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _umask() -> int:
    """Permission bits that new files do not get; it can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


def write_csv(path: str | Path, columns: Mapping[str, np.ndarray]) -> None:
    """A table: one line of names, then one line a row. All columns have shape (n,)."""
    table = np.column_stack([np.asarray(column, float) for column in columns.values()])
    with whole_file(path) as file:
        file.write(",".join(columns) + "\n")
        for row in table:
            file.write(",".join(format(x, DIGITS) for x in row) + "\n")


def write_json(path: str | Path, content: Any) -> None:
    """Indented JSON."""
    with whole_file(path) as file:
        json.dump(content, file, indent=2)
        file.write("\n")


def with_unit(name: str, unit: str) -> str:
    """Name of a column: 'elbow.rate' in 'rad/s' is 'elbow.rate_rad_per_s'; numbers without unit keep their name."""
    plain = unit.replace("/", "_per_").replace("^", "").replace(" ", "")
    return f"{name}_{plain}" if plain not in ("", "-") else name

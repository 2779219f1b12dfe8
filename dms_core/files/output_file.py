"""Writing results: every file of the three packages is written by `write_file` or by what stands on it."""

from __future__ import annotations

import csv
import io
import json
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from dms_core.errors import InputError, printable
from dms_core.files.json_text import finite
from dms_core.files.output_place import Content, check_kind, put
from dms_core.files.outputs import active_outputs

DIGITS = ".12g"
"""Format of numbers in tables: more digits than any tolerance in use, fewer than rounding shows."""
LARGEST_TABLE = 2**29
"""Numbers of a table in memory [byte]; as text they take about twice as much."""


def write_file(path: str | Path, content: Content) -> None:
    """Write a file whole or not at all.

    Within a command's `Outputs`, what cannot be written at its place is kept elsewhere.

    Args:
        path: of the file; its folder is made where it is missing.
        content: writes into an open binary file; may be called again for another place.

    Raises:
        InputError: what is there must not be replaced.
        OSError: the disk is full or cannot be written; what was there before is still there.
    """
    outputs = active_outputs()
    if outputs is None:
        put(check_kind(path), content)
    else:
        outputs.write(Path(path), content)


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write bytes, see `write_file`."""
    write_file(path, lambda file: file.write(content))


def write_text(path: str | Path, text: str) -> None:
    """Write text as UTF-8, see `write_file`; what UTF-8 cannot say (half of a surrogate pair) is escaped."""
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def write_csv(
    path: str | Path, columns: Mapping[str, np.ndarray] | Callable[[], Iterable[Mapping[str, np.ndarray]]]
) -> None:
    """A table: one line of names, then one line a row.

    Names with commas or quotes are quoted (RFC 4180).

    Args:
        path: of the file.
        columns: by name, shape (n,) each, of numbers or of words; or a function that gives the same in parts, one below
            the other.

    Raises:
        InputError: a name holds a line break.
    """

    def content(file: IO[bytes]) -> None:
        for k, part in enumerate((columns,) if isinstance(columns, Mapping) else columns()):
            if k == 0:
                file.write(_head(list(part)))
            cells = [_cells(np.asarray(column)) for column in part.values()]
            file.writelines(f"{','.join(row)}\n".encode() for row in zip(*cells, strict=True))

    write_file(path, content)


def check_columns(names: Iterable[str]) -> None:
    """Refuse names that cannot head a table, before the run whose table it is.

    Raises:
        InputError: a name holds a line break or another character that cannot be printed, or stands twice.
    """
    seen: set[str] = set()
    for name in names:
        # A space that does not break is a space to every reader.
        if not all(c.isprintable() or unicodedata.category(c) == "Zs" for c in name):
            raise InputError(f"column {name!r}: expected a name without line breaks and other control characters.")
        if name in seen:
            raise InputError(f"column '{name}' would stand twice in the table; give the sensor another name.")
        seen.add(name)


def check_size(option: str, seconds: float, sample: float, columns: int) -> None:
    """Refuse a table that would be too large, before the run.

    Args:
        option: that decides the number of rows, as '--sample'.
        seconds: of the run [s].
        sample: time between rows [s].
        columns: numbers a row.

    Raises:
        InputError: says how large the table would be and what is allowed.
    """
    size = (seconds / sample + 1.0) * columns * 8.0
    if size > LARGEST_TABLE:
        rows = LARGEST_TABLE // (8 * columns) - 1
        raise InputError(
            f"{option} {sample:g}: {seconds / sample:.3g} rows of {columns} numbers take {size / 2**30:.3g} GiB. "
            f"Expected at least {seconds / rows:.3g} s, for a table of at most {LARGEST_TABLE / 2**30:g} GiB."
        )


def _cells(column: np.ndarray) -> Iterator[str]:
    """Cells of a column, one by one: words, or numbers with DIGITS."""
    if column.dtype.kind == "U":
        return (_quoted([word]) for word in column)
    return (format(x, DIGITS) for x in column.astype(float, copy=False))


def _head(names: list[str]) -> bytes:
    """The first line."""
    check_columns(names)
    return f"{_quoted(names)}\n".encode("utf-8", "backslashreplace")


def _quoted(cells: Sequence[str]) -> str:
    """Cells of a line; those with commas or quotes are quoted."""
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(cells)
    return line.getvalue()


def write_json(path: str | Path, content: Any) -> None:
    """Indented JSON; JSON has no NaN: what is not finite is null."""
    write_text(path, json.dumps(finite(content), indent=2, allow_nan=False) + "\n")


def with_unit(name: str, unit: str) -> str:
    """Name of a column: 'elbow.rate' in 'rad/s' is 'elbow.rate_rad_per_s'; numbers without unit keep their name."""
    plain = unit.replace("/", "_per_").replace("^", "").replace(" ", "")
    return f"{name}_{plain}" if plain not in ("", "-") else name


def markdown_cell(text: str) -> str:
    """A text as cell of a Markdown table: a bar would end it."""
    return printable(text).replace("|", "\\|")

"""Tables that a user gives as CSV: columns by name, every cell a finite number, times that rise without holes."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dms_core.errors import InputError, choices
from dms_core.files.input_file import decoded, read_bytes

MOST_BYTES = 200_000_000
"""Largest table [bytes]."""
HOLE = 5.0
"""Interval between two rows over the usual one from which it counts as a hole."""
UNITS = {
    "": 1.0, "-": 1.0, "rad": 1.0, "deg": math.pi / 180.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "s": 1.0, "ms": 1e-3,
    "N": 1.0, "kN": 1e3, "Nm": 1.0, "V": 1.0, "A": 1.0, "percent": 1e-2,
}  # fmt: skip
"""Units that a column may have, and their size in SI units."""


class CsvTable(NamedTuple):
    """Columns of a file."""

    path: Path
    columns: dict[str, np.ndarray]
    """By name, shape (n,) each."""
    lines: list[int]
    """Line of each row in the file."""

    def column(self, name: str) -> np.ndarray:
        """The column of that name.

        Raises:
            InputError: there is none; lists the names.
        """
        if name not in self.columns:
            raise _no_column(self.path, name, self.columns)
        return self.columns[name]


def read_table(path: str | Path, wanted: tuple[str, ...] = ()) -> CsvTable:
    """A table whose first line holds names; the others hold numbers.

    Args:
        path: CSV file, with commas, semicolons or tabs between cells.
        wanted: names of the columns that are read; default: all. What stands in others does not matter.

    Raises:
        InputError: a column is missing or stands twice, a cell is empty or no finite number; names file, line, column.
    """
    names, rows = _begun(path)
    for name in wanted:
        if name not in names:
            raise _no_column(path, name, names)
    places = [(name, names.index(name)) for name in (wanted or names)]
    values: list[list[float]] = []
    lines = []
    for cells in rows:
        if not any(cell.strip() for cell in cells):
            continue
        values.append([_number(path, rows.line_num, name, cells, k) for name, k in places])
        lines.append(rows.line_num)
    if not values:
        raise InputError(f"table '{path}' has column names but no rows.")
    table = np.array(values)
    return CsvTable(Path(path), {name: table[:, k].copy() for k, (name, _) in enumerate(places)}, lines)


def column_names(path: str | Path) -> list[str]:
    """Names of all columns of a table.

    Raises:
        InputError: the table is empty, or a column stands twice.
    """
    return _begun(path)[0]


def _begun(path: str | Path) -> tuple[list[str], Any]:
    """Names of the columns, and a reader of the lines behind them."""
    text = decoded(path, read_bytes(path, MOST_BYTES))
    first = text.partition("\n")[0]
    separator = max(",;\t", key=first.count)
    rows = csv.reader(io.StringIO(text), delimiter=separator)
    names = [name.strip() for name in next(rows, [])]
    if not any(names):
        raise InputError(f"table '{path}' is empty. Expected a line of column names, then lines of numbers.")
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"table '{path}': column '{name}' stands {names.count(name)} times; expected it once.")
    return names, rows


def _no_column(path: str | Path, name: str, names: Iterable[str]) -> InputError:
    """The error of a column that is not there."""
    return InputError(f"table '{path}': column '{name}' does not exist. There are: {choices(names)}.")


def _number(path: str | Path, line: int, name: str, cells: list[str], k: int) -> float:
    """The number in a cell."""
    text = cells[k].strip() if k < len(cells) else ""
    where = f"table '{path}', line {line}, column '{name}'"
    if not text:
        raise InputError(f"{where}: the cell is empty. Expected a number; fill the gap, or cut the table there.")
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{where}: Expected a number with a decimal point, got {text[:40]!r}.") from None
    if not math.isfinite(value):
        raise InputError(f"{where}: Expected a finite number, got {text[:40]}; fill the gap, or cut the table there.")
    return value


def check_times(table: CsvTable, name: str, times: np.ndarray, longest: float | None) -> None:
    """Refuse times that do not rise, or that leave a hole.

    Args:
        table: where they are from.
        name: of their column.
        times: [s].
        longest: interval between two rows that is still no hole [s]; default: HOLE times the usual one.

    Raises:
        InputError: names the lines.
    """
    steps = np.diff(times)
    if np.any(steps <= 0.0):
        k = int(np.argmax(steps <= 0.0))
        what = "stands twice" if steps[k] == 0.0 else "falls"
        raise InputError(
            f"table '{table.path}', line {table.lines[k + 1]}: the time in '{name}' {what}: {times[k + 1]:.9g} s "
            f"behind {times[k]:.9g} s. Expected times that rise from row to row."
        )
    allowed = longest if longest is not None else HOLE * float(np.median(steps)) if len(steps) else np.inf
    if np.any(steps > allowed * (1.0 + 1e-9)):
        k = int(np.argmax(steps))
        usual = (
            f"rows are usually {np.median(steps):.4g} s apart" if longest is None else f"longest_gap is {longest:g} s"
        )
        raise InputError(
            f"table '{table.path}', line {table.lines[k + 1]}: nothing is known from {times[k]:.9g} to "
            f"{times[k + 1]:.9g} s, while {usual}. Fill the gap, or allow it with longest_gap: {steps[k]:.4g}."
        )


def unit_factor(path: str | Path, name: str, unit: str | None) -> float:
    """Size of a column's unit in SI units.

    Args:
        path: of the table, for errors.
        name: of the column, whose ending may tell the unit as in 'elbow_deg'.
        unit: that is declared; None where none is.

    Raises:
        InputError: the unit is not known, contradicts the name, or is none of SI and not declared.
    """
    told = name.rpartition("_")[2] if "_" in name else ""
    told = told if told in UNITS else ""
    if unit is None:
        if told and UNITS[told] != 1.0:
            raise InputError(
                f"table '{path}': column '{name}' seems to be in {told}, and models count in SI units. Say so with "
                f"unit: {told}, or rename the column."
            )
        return 1.0
    if unit not in UNITS:
        raise InputError(f"table '{path}', column '{name}': unit '{unit}' is not known. Allowed: {choices(UNITS)}.")
    if told and told != unit:
        raise InputError(f"table '{path}': column '{name}' seems to be in {told}, but unit: {unit} is declared.")
    return UNITS[unit]

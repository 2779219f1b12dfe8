"""Measurement files: what sensors showed at which times, as CSV or `.sto`, checked against a model's sensors.

A column is named after a component of a sensor as `run` writes it, `elbow.angle_rad`, or without its unit
(`elbow.angle`, in SI units), or in another unit of the same kind (`elbow.angle_deg`). An empty cell, or NaN, says that
the sensor told nothing then, so that each has a rate of its own. A column may also be named after an input of the
model: it was held at that value until the next row that tells one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dms_core.assembly.model import Model
from dms_core.errors import InputError, choices
from dms_core.files.csv_table import MOST_BYTES
from dms_core.files.input_file import decoded, read_bytes
from dms_core.files.output_file import with_unit

TIME = ("time_s", "time", "t")
"""Names that the column of times may have; it is in seconds."""
MISSING = ("", "nan")
"""Cells that tell nothing."""
KIN = {
    "rad": {"deg": math.pi / 180.0}, "m": {"cm": 1e-2, "mm": 1e-3}, "N": {"kN": 1e3}, "Nm": {"Nmm": 1e-3},
    "s": {"ms": 1e-3}, "V": {"mV": 1e-3}, "A": {"mA": 1e-3}, "": {"percent": 1e-2}, "kg": {"g": 1e-3},
}  # fmt: skip
"""Units of the same kind as an SI unit, and their size in it."""


@dataclass(frozen=True)
class Measurements:
    """Readings of sensors, in SI units."""

    t: np.ndarray
    """Rising times [s], shape (k,)."""
    channels: tuple[str, ...]
    """Names of sensor components."""
    y: np.ndarray
    """Readings, NaN where there was none, shape (k, channels)."""
    inputs: dict[str, np.ndarray]
    """Known values of inputs by name, NaN where none was told, shape (k,) each."""

    def __post_init__(self) -> None:
        for k in np.flatnonzero(~(np.diff(self.t) > 0.0))[:1]:
            raise InputError(
                f"measurements: the time runs backwards or stands still: {self.t[k + 1]:.9g} s behind {self.t[k]:.9g} "
                f"s in row {k + 2}. Expected times that rise from row to row."
            )
        if not np.isfinite(self.t).all() or np.isinf(self.y).any():
            raise InputError("measurements: Expected finite times and readings; a missing reading is NaN.")


def read_measurements(path: str | Path, model: Model, names: Sequence[str] | None = None) -> Measurements:
    """Readings of a file, checked against the sensors and inputs of a model.

    Args:
        path: CSV file, or one of OpenSim's storages (`.sto`, `.mot`) with `endheader` above the names.
        model: that the readings are for.
        names: sensor components that must be there; default: any.

    Raises:
        InputError: a column belongs to no sensor or input, is in another unit, stands twice or is missing; a cell is
            no number; times do not rise. Names file, column and line.
    """
    heads, rows, degrees = _table(Path(path))
    time = [k for k, head in enumerate(heads) if head in TIME]
    if len(time) != 1:
        raise InputError(
            f"measurements '{path}': Expected one column of times, {' or '.join(TIME)}; the columns are: "
            f"{choices(heads)}."
        )
    for head in heads:
        if heads.count(head) > 1:
            raise InputError(
                f"measurements '{path}': column '{head}' stands {heads.count(head)} times; expected it once."
            )
    found = {head: _target(path, head, model, degrees) for k, head in enumerate(heads) if k != time[0]}
    _check_targets(path, found, names)
    t, lines, values = [], [], []
    for line, cells in rows:
        values.append([math.nan if k == time[0] else _reading(path, line, heads, cells, k) for k in range(len(heads))])
        t.append(_time(path, line, heads[time[0]], cells, time[0]))
        lines.append(line)
        if len(t) > 1 and not t[-1] > t[-2]:
            raise InputError(
                f"measurements '{path}', line {line}: the time "
                f"{'stands still' if t[-1] == t[-2] else 'runs backwards'}: {t[-1]:.9g} s behind {t[-2]:.9g} s. "
                "Expected times that rise from row to row."
            )
    if not t:
        raise InputError(f"measurements '{path}' have column names but no rows.")
    table = np.array(values)
    sensors = {x[0]: table[:, heads.index(h)] * x[1] for h, x in found.items() if x[0] not in model.layout.input_index}
    inputs = {x[0]: table[:, heads.index(h)] * x[1] for h, x in found.items() if x[0] in model.layout.input_index}
    y = np.column_stack([*sensors.values()]) if sensors else np.zeros((len(t), 0))
    return Measurements(np.array(t), tuple(sensors), y, inputs)


def _check_targets(path: str | Path, found: dict[str, tuple[str, float]], names: Sequence[str] | None) -> None:
    """Refuse two columns for one thing, and a sensor without a column."""
    told = [name for name, _ in found.values()]
    for name in told:
        if told.count(name) > 1:
            columns = [head for head, x in found.items() if x[0] == name]
            raise InputError(
                f"measurements '{path}': the columns {', '.join(columns)} all tell '{name}'; expected one."
            )
    for name in names or ():
        if name not in told:
            raise InputError(
                f"measurements '{path}': no column tells sensor '{name}', which the settings list under channels. The "
                f"columns tell: {choices(told)}."
            )


def _target(path: str | Path, head: str, model: Model, degrees: bool) -> tuple[str, float]:
    """The sensor component or input that a column tells, and the size of its unit."""
    outputs = dict(model.layout.outputs)
    if head in model.layout.input_index:
        return head, 1.0
    for name, unit in outputs.items():
        if head == name:
            turned = degrees and unit.startswith("rad")
            return name, KIN["rad"]["deg"] if turned else 1.0
        for other, size in _kin(unit):
            if head == with_unit(name, other):
                return name, size
    close = [name for name in outputs if head.startswith(f"{name}_")]
    if close:
        name = max(close, key=len)
        allowed = choices(with_unit(name, other) for other, _ in _kin(outputs[name]))
        raise InputError(
            f"measurements '{path}': column '{head}' is in another unit than sensor '{name}', which is in "
            f"{outputs[name] or 'no unit'}. Expected one of {allowed}."
        )
    raise InputError(
        f"measurements '{path}': column '{head}' belongs to no sensor and no input of system '{model.system.name}'. "
        f"Its sensors: {choices(outputs)}. Its inputs: {choices(model.layout.input_index)}."
    )


def _kin(unit: str) -> Iterator[tuple[str, float]]:
    """A unit and those of the same kind, with their sizes in it; 'rad/s' has those of 'rad'."""
    yield unit, 1.0
    above, stroke, below = unit.partition("/")
    for other, size in KIN.get(above, {}).items():
        yield f"{other}{stroke}{below}", size


def _table(path: Path) -> tuple[list[str], Iterator[tuple[int, list[str]]], bool]:
    """Names of the columns, rows with their lines, and whether angles are in degrees as a storage's header says."""
    lines = decoded(path, read_bytes(path, MOST_BYTES)).splitlines()
    first, degrees = 0, False
    if path.suffix in (".sto", ".mot"):
        ends = [k for k, line in enumerate(lines) if line.strip().lower() == "endheader"]
        if not ends:
            raise InputError(f"measurements '{path}': Expected a line 'endheader' above the names, as storages have.")
        header = [line.strip().lower().replace(" ", "") for line in lines[: ends[0]]]
        first, degrees = ends[0] + 1, "indegrees=yes" in header
    while first < len(lines) and not lines[first].strip():
        first += 1
    if first == len(lines):
        raise InputError(f"measurements '{path}' are empty. Expected a line of column names, then lines of numbers.")
    separator = max(",;\t", key=lines[first].count)
    heads = [cell.strip() for cell in lines[first].split(separator)]
    cells = ((k + 1, lines[k].split(separator)) for k in range(first + 1, len(lines)) if lines[k].strip())
    return [_unquoted(head) for head in heads], ((line, list(map(_unquoted, row))) for line, row in cells), degrees


def _unquoted(cell: str) -> str:
    """A cell without the quotes that some programs write about it."""
    text = cell.strip()
    return text[1:-1].strip() if len(text) > 1 and text[0] == text[-1] == '"' else text


def _reading(path: str | Path, line: int, heads: list[str], cells: list[str], k: int) -> float:
    """The number in a cell, NaN where it tells nothing."""
    text = cells[k].strip() if k < len(cells) else ""
    if text.lower() in MISSING:
        return math.nan
    try:
        value = float(text)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise InputError(
            f"measurements '{path}', line {line}, column '{heads[k]}': Expected a number, or an empty cell where the "
            f"sensor told nothing, got {text[:40]!r}."
        )
    return value


def _time(path: str | Path, line: int, head: str, cells: list[str], k: int) -> float:
    """The time of a row [s]."""
    value = _reading(path, line, [head] * (k + 1), cells, k)
    if not value >= 0.0:
        raise InputError(
            f"measurements '{path}', line {line}, column '{head}': Expected a time of at least 0 s, got "
            f"{cells[k].strip() if k < len(cells) else ''!r}; the model's own inputs begin at 0."
        )
    return value

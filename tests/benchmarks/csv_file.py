"""Tables as CSV files, with the command and the day on their first lines."""

from __future__ import annotations

import csv
import os
import shlex
import sys
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any


def write(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table; numbers with four digits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# python {shlex.join(_command())}\n")
        file.write(f"# {datetime.now(UTC):%Y-%m-%d %H:%M} UTC, {os.cpu_count()} cores{load}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([f"{x:.4g}" if isinstance(x, float) else x for x in row] for row in rows)


def _command() -> list[str]:
    """The arguments of Python, the script from the top of the project."""
    script = Path(sys.argv[0]).resolve()
    top = Path(__file__).parents[2]
    return [str(script.relative_to(top)) if script.is_relative_to(top) else script.name, *sys.argv[1:]]

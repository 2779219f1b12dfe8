"""What the scripts that time other programs have in common: their arguments and the rows that they write.

A row says (system, program, setting, error, ms, gap_m). Systems and units of `ms`, normalised by calibration.py:

    elbow              a simulated second; error of the elbow angle [rad]
    arm26 ...          a simulated second; error of the elbow angle [rad]
    chain N            a simulated second; error of the tip [m], gap_m the largest opening of a joint [m]
    beam N             a simulated second; error of the tip of a beam of N elements [m]
    slider-crank       a simulated second; error of the middle of its rod [m]
    growth N           a simulated second of the beam in steps of 1 ms; error of its tip [m]
    environment        a control period, resets included; a reset, for the setting "reset"
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

COLUMNS = ("system", "program", "setting", "error", "ms", "gap_m")
Row = dict[str, Any]


def row(
    system: str, program: str, setting: str, seconds: float, *, error: float | None = None, gap: float | None = None
) -> Row:
    """A row, printed too; `seconds` are normalised."""
    found = dict(zip(COLUMNS, (system, program, setting, error, seconds * 1e3, gap), strict=True))
    numbers = "  ".join(
        f"{name} {number:.2e}" for name, number in (("error", error), ("gap", gap)) if number is not None
    )
    print(f"{system:18} {program:28} {setting:36} {seconds * 1e3:10.3f} ms  {numbers}", flush=True)
    return found


def parser(text: str | None) -> argparse.ArgumentParser:
    """With the arguments that all have."""
    found = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    found.add_argument("--repeats", type=int, default=5, help="of each timing; the median counts")
    found.add_argument("--json", type=Path, help="file for the rows")
    return found


def save(path: Path | None, rows: Sequence[Row]) -> None:
    """Write the rows, where a file was named."""
    if path is not None:
        path.write_text(json.dumps(list(rows), indent=1), encoding="utf-8")

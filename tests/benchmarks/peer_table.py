"""Figures of other programs: those measured in this session by `make bench-peers`, else those of peers.csv.

peers/record.py says what a row is. Standard library only, so that peers/run.py can use it anywhere.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SHIPPED = Path(__file__).parent / "peers.csv"
MEASURED = Path("out/bench/peers.json")


@dataclass(frozen=True)
class Figure:
    """A row; nan where there is no number."""

    system: str
    program: str
    setting: str
    error: float
    """[rad] or [m]."""
    ms: float
    """Normalised, see peers/record.py."""
    gap_m: float
    """[m]."""
    taken: str = ""
    """Day, of shipped figures."""

    @classmethod
    def of(cls, row: dict[str, Any]) -> Figure:
        """A row of either file."""
        numbers = [math.nan if row.get(k) in (None, "") else float(row[k]) for k in ("error", "ms", "gap_m")]
        return cls(row["system"], row["program"], row["setting"], *numbers, row.get("taken", ""))


class PeerTable:
    """Figures by system.

    Args:
        path: of the session's file; where it is missing, or lacks a system, peers.csv stands in.
    """

    def __init__(self, path: Path = MEASURED) -> None:
        self.shipped = [Figure.of(row) for row in read_shipped()]
        self.measured: list[Figure] = []
        self._said = ""
        if path.exists():
            content = json.loads(path.read_text(encoding="utf-8"))
            self.measured = [Figure.of(row) for row in content["rows"]]
            quick = ", a quick look" if content["quick"] else ""
            self._said = f"{path}, {content['taken']}, load {content['load']}{quick}"

    def of(self, system: str, program: str = "") -> list[Figure]:
        """Figures of a system, of programs whose name and setting hold the words of `program`."""
        rows = [f for f in self.measured if f.system == system] or [f for f in self.shipped if f.system == system]
        return [f for f in rows if all(word in f"{f.program} {f.setting}" for word in program.split())]

    def origin(self, system: str) -> str:
        """Where the figures of a system are from, in words."""
        if any(f.system == system for f in self.measured):
            return f"measured: {self._said}"
        days = " and ".join(sorted({f.taken for f in self.shipped if f.system == system}))
        return (
            f"shipped table {SHIPPED.name}, taken on {days} with the same calibration; `make bench-peers` measures them"
        )


def read_shipped() -> list[dict[str, str]]:
    """Rows of peers.csv."""
    with SHIPPED.open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def write_shipped(new: Sequence[dict[str, Any]], day: str) -> None:
    """peers.csv with the new rows in place of those of the same kind of system and program."""

    def kind(row: dict[str, Any]) -> tuple[str, str]:
        return row["system"].split()[0], row["program"].split()[0]

    old, replaced = read_shipped(), {kind(row) for row in new}
    comments = [line for line in SHIPPED.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
    with SHIPPED.open("w", encoding="utf-8", newline="") as file:
        file.write("\n".join(comments) + "\n")
        writer = csv.DictWriter(file, list(old[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(row for row in old if kind(row) not in replaced)
        writer.writerows({k: _short(v) for k, v in row.items()} | {"taken": day} for row in new)


def _short(value: Any) -> Any:
    """Numbers with four digits."""
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else value


def cost_at(points: Sequence[tuple[float, float]], error: float) -> float:
    """Cost at an error, from points of (error, cost): log-log between the best ones; the cheapest where all are better.

    nan where no point is as exact as that.
    """
    best: list[tuple[float, float]] = []
    for e, cost in sorted((e, c) for e, c in points if e > 0.0):
        if not best or cost < best[-1][1]:
            best.append((e, cost))
    if not best or best[0][0] > error:
        return math.nan
    for (e_0, c_0), (e_1, c_1) in zip(best[:-1], best[1:], strict=True):
        if e_0 <= error < e_1:
            return c_0 * (c_1 / c_0) ** (math.log(error / e_0) / math.log(e_1 / e_0))
    return best[-1][1]

"""Tables that commands write, as the tests read them."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np


def read(path: Path) -> dict[str, np.ndarray]:
    """A CSV table by column, of numbers or of words."""
    with path.open(newline="") as file:
        names, *rows = csv.reader(file)
    return {name: _column(cells) for name, cells in zip(names, zip(*rows, strict=True), strict=True)}


def _column(cells: tuple[str, ...]) -> np.ndarray:
    try:
        return np.array(cells, float)
    except ValueError:
        return np.array(cells)

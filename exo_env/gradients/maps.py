"""A control period as a chain of small linear maps, each of some numbers of one long vector."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Map(NamedTuple):
    """x[written] = slope @ x[read], with all that is read taken before anything is written."""

    written: np.ndarray
    """Places in x, shape (m,)."""
    read: np.ndarray
    """Shape (n,)."""
    slope: np.ndarray
    """Shape (m, n)."""


def copied(written: np.ndarray, read: np.ndarray) -> Map:
    """The map that copies numbers."""
    return Map(written, read, np.eye(len(written)))


def carried_back(maps: list[Map], x: np.ndarray) -> None:
    """Turn derivatives by the numbers behind the maps into those by the numbers ahead of them, in place.

    Args:
        maps: in the order in which they were applied.
        x: derivatives of one quantity by all numbers.
    """
    for one in reversed(maps):
        by_written = x[one.written]
        x[one.written] = 0.0
        x[one.read] += by_written @ one.slope

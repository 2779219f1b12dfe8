"""Whether a table fits into the memory that is free, asked before it is filled."""

from __future__ import annotations

import math
import os

from dms_core.errors import InputError


def free_memory() -> float:
    """Memory that is free [byte]; infinite where the system does not tell."""
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):
        return math.inf


def check_memory(what: str, rows: float, columns: int) -> None:
    """Refuse a table of numbers that would need more memory than is free.

    Args:
        what: the option and its value, as 'sample: 1e-09 s'.
        rows: number of rows, which may be far above what an integer of a loop can hold.
        columns: numbers a row.

    Raises:
        InputError: says how much memory it takes and how much there is.
    """
    needed, free = 8.0 * rows * columns, free_memory()
    if not needed <= free:
        raise InputError(
            f"{what}: {rows:.3g} rows of {columns} numbers take {needed / 2**30:.3g} GiB, and {free / 2**30:.3g} GiB "
            "of memory are free. Take samples further apart, or a part of the run at a time."
        )

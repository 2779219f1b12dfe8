"""What a reset sets to zero: every array that is declared as cleared, so that no reset can forget one.

Arrays of a world stand in NamedTuples (exo_env/tables.py). Each field says whether its array is `Kept`, made with the
environment or filled before a reset reads it, or `Cleared`, set to zero at each reset before anything is put into it.
"""

from __future__ import annotations

from typing import Annotated, Any, get_type_hints

import numpy as np

from dms_core.kernels import Packed, floats
from exo_env.jit import compiled

Kept = Annotated[np.ndarray, "kept"]
Cleared = Annotated[np.ndarray, "cleared"]


def cleared_areas(values: Any) -> np.ndarray:
    """Address and number of words of every array of a NamedTuple, nested ones included, that a reset clears.

    Raises:
        TypeError: a field says neither that it is kept nor that it is cleared.
    """
    return np.array(_areas(values), np.int64).reshape(-1, 2)


def _areas(values: Any) -> list[tuple[int, int]]:
    """Address and number of words of each array that a reset clears."""
    areas: list[tuple[int, int]] = []
    hints = get_type_hints(type(values), include_extras=True)
    for name, value in zip(values._fields, values, strict=True):
        where = f"{type(values).__name__}.{name}"
        if isinstance(value, Packed):
            continue
        if isinstance(value, tuple):
            areas += _areas(value)
        elif hints[name] == Cleared:
            if value.itemsize != 8:
                raise TypeError(f"{where}: expected numbers of 8 bytes, got {value.dtype}.")
            areas.append((value.ctypes.data, value.size))
        elif hints[name] != Kept:
            raise TypeError(f"{where}: declare it as Kept or as Cleared (exo_env/clearing.py).")
    return areas


@compiled
def clear(areas):
    """Set the areas, rows of address and number of words, to zero."""
    for k in range(areas.shape[0]):
        floats(areas, k)[:] = 0.0

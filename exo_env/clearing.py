"""What a reset sets to zero: every array that is declared as cleared, so that no reset can forget one.

Arrays of a world stand in NamedTuples (exo_env/tables.py). Each field says whether its array is `Kept`, made with the
environment and the same in all episodes, `Filled` anew for each episode before anything reads it, or `Cleared`, set to
zero at each reset before anything is put into it. The last two are what an episode is.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, get_type_hints

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.kernels import Packed, floats

Kept = Annotated[np.ndarray, "kept"]
Filled = Annotated[np.ndarray, "filled"]
Cleared = Annotated[np.ndarray, "cleared"]


def cleared_areas(values: Any) -> np.ndarray:
    """Address and number of words of every array of a NamedTuple, nested ones included, that a reset clears.

    Raises:
        TypeError: a field does not say what a reset does to it, or a cleared array has other numbers than of 8 bytes.
    """
    areas = [(array.ctypes.data, array.size) for _, array in arrays_of(values, Cleared)]
    return np.array(areas, np.int64).reshape(-1, 2)


def arrays_of(values: Any, *kinds: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Name and array of every field of a NamedTuple, nested ones included, that is of one of some kinds.

    Raises:
        TypeError: a field is of no kind, or a cleared array has other numbers than of 8 bytes.
    """
    kind: Any = type(values)
    hints = _kinds(kind)
    for name, value in zip(values._fields, values, strict=True):
        where = f"{kind.__name__}.{name}"
        if isinstance(value, Packed):
            continue
        if isinstance(value, tuple):
            yield from arrays_of(value, *kinds)
            continue
        if hints[name] not in (Kept, Filled, Cleared):
            raise TypeError(f"{where}: declare it as Kept, Filled or Cleared (exo_env/clearing.py).")
        if hints[name] == Cleared and value.itemsize != 8:
            raise TypeError(f"{where}: expected numbers of 8 bytes, got {value.dtype}.")
        if hints[name] in kinds:
            yield where, value


@cache
def _kinds(tables: type) -> dict[str, Any]:
    """What each field of a NamedTuple class declares."""
    return get_type_hints(tables, include_extras=True)


@compiled
def clear(areas):
    """Set the areas, rows of address and number of words, to zero."""
    for k in range(areas.shape[0]):
        floats(areas, k)[:] = 0.0

"""The numbers of a kernel's table by name: each element declares their places once, as a NamedTuple of integers.

    class Spring(NamedTuple):
        point: int = 0      # three numbers
        stiffness: int = 3

    SPRING = Spring()

The kernel reads `vec(par, SPRING.point)` and `par[SPRING.stiffness]`, `place()` writes `numbers_at(SPRING, point=...,
stiffness=...)`, and whoever reads the table from outside uses the same names.
"""

from __future__ import annotations

from typing import Any

import numpy as np


def numbers_at(places: Any, **values: Any) -> tuple[float, ...]:
    """The table of numbers: each value, one number or several, at the place of its name.

    Args:
        places: NamedTuple of places, in rising order.
        values: one for each name.

    Raises:
        ValueError: a value is missing, or does not begin and end where its place and the next one say.
    """
    table: list[float] = []
    for name, place in zip(places._fields, places, strict=True):
        if len(table) != place:
            raise ValueError(f"Expected '{name}' at place {place} of {type(places).__name__}, got place {len(table)}.")
        table += [float(x) for x in np.ravel(values.pop(name))]
    if values:
        raise ValueError(f"Expected values for {places._fields} of {type(places).__name__}, got {tuple(values)} too.")
    return tuple(table)

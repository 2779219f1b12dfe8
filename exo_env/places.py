"""Places in arrays by names that are built once: compiled code says `r[READING.angle]`, never `r[0]`."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterable
from typing import Any


def places(names: Iterable[str]) -> Any:
    """A named tuple that holds the number of each name, in the given order; compiled code takes it as constants.

    Args:
        names: different names that are Python identifiers.
    """
    listed = list(names)
    return namedtuple("Places", listed)(*range(len(listed)))

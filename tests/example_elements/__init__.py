"""One small system for every kind of element: what `tests/test_derivatives.py` differentiates.

Each module of this package covers one branch of `dms_core.model` and may define

    EXAMPLES    {kind: (function, ...)}, each function returns an `Example`
    COMPOSITES  {kind: "which test covers it"}: sensors without a kernel of their own

A kind with neither fails the test, so that no element escapes it.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from typing import NamedTuple

from dms_core.model.element import Declaration
from dms_core.model.system import System

Range = tuple[float, float]


class Example(NamedTuple):
    """An element in a system, and where its coordinates and inputs make sense.

    Keys of the ranges are names as in `Placement`: "biceps.fibre" among coordinates, "pull" among inputs. What is not
    named is drawn about 0 (rates, inputs) or about the declared start (coordinates), in units of the declared scale.
    """

    system: System
    element: Declaration
    q: dict[str, Range] = {}
    v: dict[str, Range] = {}
    u: dict[str, Range] = {}


def _merged(attribute: str) -> dict:
    """The dictionaries of all modules in one; a kind is covered by one module only."""
    merged: dict = {}
    for info in pkgutil.iter_modules(__path__):
        entries = getattr(importlib.import_module(f"{__name__}.{info.name}"), attribute, {})
        twice = merged.keys() & entries.keys()
        if twice:
            raise AssertionError(f"{attribute} of {info.name}.py: {sorted(twice)} already stand in another module")
        merged.update(entries)
    return merged


def examples() -> dict[str, tuple[Callable[[], Example], ...]]:
    """All examples by kind."""
    return _merged("EXAMPLES")


def composites() -> dict[str, str]:
    """Kinds without a kernel of their own, with the test that covers them."""
    return _merged("COMPOSITES")

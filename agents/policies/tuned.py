"""Numbers of the baselines: where they may lie, and those that `python -m agents tune-baselines` found.

They stand in a file of configs/baselines, a policy a key, and are the ones that a policy uses by default: in
baselines.yml where device and patient share a reference, in hidden_intent.yml where the patient's plan is hidden.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeVar

import numpy as np

from dms_core.errors import InputError
from dms_core.files.config_files import configs
from dms_core.files.json_text import brief
from dms_core.files.yaml_text import read_yaml

FILE, HIDDEN_INTENT = "baselines/baselines.yml", "baselines/hidden_intent.yml"
"""Under configs/: numbers for tasks with a reference, and for those whose plan is hidden."""
Number = float | np.ndarray
"""A number, or one for each of many worlds, shape (n,)."""
N = TypeVar("N", bound=Number)


@dataclass(frozen=True)
class Range:
    """Where a number may lie."""

    low: float
    high: float
    logarithmic: bool = False

    def at(self, x: float) -> float:
        """The number at a place from 0 to 1, rounded to three digits."""
        x = min(max(x, 0.0), 1.0)
        if self.logarithmic:
            value = math.exp(math.log(self.low) + x * math.log(self.high / self.low))
        else:
            value = self.low + x * (self.high - self.low)
        return float(f"{value:.3g}")


@cache
def tuned(file: str) -> dict[str, Any]:
    """What a search found, by policy.

    Args:
        file: its place under configs/.

    Raises:
        InputError: there is no such file, or it is no YAML.
    """
    return read_yaml(configs() / file)


def numbers(policy: str, ranges: Mapping[str, Range], given: Mapping[str, N], file: str = FILE) -> dict[str, N]:
    """All numbers of a policy: those given, and the tuned ones for the rest.

    Args:
        policy: its name.
        ranges: where each number may lie.
        given: numbers that replace the tuned ones; an array has one for each of many worlds.
        file: that holds the tuned ones, under configs/.

    Raises:
        InputError: a number is unknown or outside its range.
    """
    found = {} if given.keys() == ranges.keys() else tuned(file).get(policy)
    if not isinstance(found, dict):
        raise InputError(f"'{configs() / file}' holds no numbers of '{policy}': expected a mapping. Reinstall exo-env.")
    used = {**found, **given}
    if used.keys() != ranges.keys():
        raise InputError(f"policy '{policy}': its numbers are {', '.join(ranges)}, got {', '.join(used)}.")
    for name, value in used.items():
        if not _within(ranges[name], value):
            r, said = ranges[name], brief(repr(value), 60)
            raise InputError(f"policy '{policy}': {name} = {said}: expected a number from {r.low:g} to {r.high:g}.")
    return {name: used[name] for name in ranges}


def _within(r: Range, value: object) -> bool:
    """Whether a value is a number of a range, or an array of such numbers."""
    if isinstance(value, np.ndarray):
        return value.ndim == 1 and value.dtype.kind == "f" and bool(((r.low <= value) & (value <= r.high)).all())
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    return number and r.low <= value <= r.high  # type: ignore[operator]

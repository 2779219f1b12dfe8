"""Numbers of the baselines: where they may lie, and those that `python -m agents tune-baselines` found.

They stand in configs/baselines/baselines.yml, a policy a key, and are the ones that a policy uses by default.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from dms_core.config_files import configs
from dms_core.errors import InputError
from dms_core.files.json_text import brief
from dms_core.files.yaml_text import read_yaml

FILE = "baselines/baselines.yml"


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
def _tuned() -> dict[str, Any]:
    return read_yaml(configs() / FILE)


def numbers(policy: str, ranges: dict[str, Range], given: dict[str, float]) -> dict[str, float]:
    """All numbers of a policy: those given, and the tuned ones for the rest.

    Args:
        policy: its name.
        ranges: where each number may lie.
        given: numbers that replace the tuned ones.

    Raises:
        InputError: a number is unknown or outside its range.
    """
    tuned = _tuned().get(policy)
    if not isinstance(tuned, dict):
        raise InputError(f"'{configs() / FILE}' holds no numbers of '{policy}': expected a mapping. Reinstall exo-env.")
    used = {**tuned, **given}
    if used.keys() != ranges.keys():
        raise InputError(f"policy '{policy}': its numbers are {', '.join(ranges)}, got {', '.join(used)}.")
    for name, value in used.items():
        r, number = ranges[name], isinstance(value, int | float | np.number) and not isinstance(value, bool)
        if not (number and r.low <= value <= r.high):
            said = brief(repr(value), 60)
            raise InputError(f"policy '{policy}': {name} = {said}: expected a number from {r.low:g} to {r.high:g}.")
    return used

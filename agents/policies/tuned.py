"""Numbers of the baselines: where they may lie, and those that `python -m agents tune-baselines` found.

They stand in configs/baselines/baselines.yml, a policy a key, and are the ones that a policy uses by default.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

from dms_core.config_files import configs
from dms_core.errors import InputError
from dms_core.yaml_text import read_yaml

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
def _tuned() -> dict[str, dict[str, float]]:
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
    used = {**_tuned()[policy], **given}
    if used.keys() != ranges.keys():
        raise InputError(f"policy '{policy}': its numbers are {', '.join(ranges)}, got {', '.join(used)}.")
    for name, value in used.items():
        if not ranges[name].low <= value <= ranges[name].high:
            r = ranges[name]
            raise InputError(f"policy '{policy}': {name} = {value}: expected a number from {r.low:g} to {r.high:g}.")
    return used

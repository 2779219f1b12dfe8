"""What of a device is designed: numbers of it by name, each within bounds, and the device that goes with them.

A name is the way to a number in the device's file, as 'ropes.agonist.lower.1' or 'guide_distance'; numbers of the
compliant cuff follow 'cuff.', as 'cuff.stiffness.0'. Where the lever of the lifting rope changes, so do the gains of
the controllers, by the formula for Kc r in paper/tuning.py, which holds inertia and damping:

    kp, ki, kd, Kc  =  those of today's device  x  r_today / r,       r at 60 degrees

That is a rule in place of a tuning; `python -m exo_env tune` does that for a device that is kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dms_core.errors import InputError, choices
from dms_core.files.yaml_text import read_yaml, said_of
from exo_env.ecosystem.cuff import Cuff
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.paper.tuning import START as TUNED_AT
from exo_env.settings import Settings

REACH = 0.03
"""How far an attachment point or the guide may be moved without bounds of one's own [m]; assumed."""
FACTOR = 2.0
"""By which the cuff may be softer or stiffer without bounds of one's own; assumed."""
CLIPPING = 7
"""Halvings by which such a bound is clipped to what a device can have: it then lies within a hundredth of the limit."""
LEAST_WIDTH = 1e-6
"""Least width of bounds in SI units, and as a part of today's value if that is above 1; nothing is made more finely."""
DESIGNED = ("ropes", "guide_distance")
"""Parts of a device's file whose numbers may be designed."""


class Bounds(Settings):
    """Least and largest value of each number that is designed, in SI units."""

    bounds: dict[str, tuple[float, float]]

    @classmethod
    def read(cls, path: str | Path) -> dict[str, tuple[float, float]]:
        """Bounds from a YAML file with a line for each number, such as 'guide_distance: [0.12, 0.18]'.

        Raises:
            InputError: the file is missing or wrong; names file, key and value.
        """
        with said_of(path):
            found = cls(bounds=read_yaml(path)).bounds
            if not found:
                raise InputError("Expected bounds of at least one number, got an empty file.")
            return found


@dataclass(frozen=True)
class Design:
    """A device, and the compliant cuff that goes with it; None: a rigid guide."""

    device: Exoskeleton
    cuff: Cuff | None = None

    def numbers(self) -> dict[str, float]:
        """Every number that may be designed, by name."""
        parts: dict[str, Any] = self.device.model_dump(include=set(DESIGNED))
        if self.cuff is not None:
            parts["cuff"] = self.cuff.model_dump()
        return dict(_numbers(parts))

    def changed(self, values: Mapping[str, float]) -> Design:
        """With other values of numbers, by name, and the gains that go with the new lever.

        Raises:
            InputError: there can be no such device, or no such cuff.
        """
        parts: dict[str, Any] = {**self.device.model_dump(), "cuff": self.cuff and self.cuff.model_dump()}
        for name, value in values.items():
            parts = _with(parts, name.split("."), value)
        cuff = parts.pop("cuff")
        device, rope = Exoskeleton(**parts), self.device.lifting_rope
        ratio = self.device.moment_arm(rope, TUNED_AT) / device.moment_arm(rope, TUNED_AT)
        gains = {name: ratio * gain for name, gain in dict(device.gains).items()}
        retuned = device.changed(gains=gains, tuning={"Kc": ratio * device.tuning.Kc})
        return Design(retuned, None if cuff is None else Cuff(**cuff))


def _numbers(value: Any, name: str = "") -> Iterator[tuple[str, float]]:
    """Numbers of nested mappings and lists, by keys and places joined with dots."""
    if isinstance(value, float):
        yield name, value
    elif isinstance(value, Mapping | tuple):
        for key, item in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from _numbers(item, f"{name}.{key}" if name else str(key))


def _with(value: Any, keys: list[str], number: float) -> Any:
    """The same nested values with one number replaced."""
    if not keys:
        return number
    if isinstance(value, Mapping):
        # A rope's name may hold dots, of which a key has as many as it takes.
        key = next(".".join(keys[:k]) for k in range(1, len(keys) + 1) if ".".join(keys[:k]) in value)
        return {**value, key: _with(value[key], keys[key.count(".") + 1 :], number)}
    return tuple(_with(x, keys[1:], number) if k == int(keys[0]) else x for k, x in enumerate(value))


def usual_bounds(design: Design) -> dict[str, tuple[float, float]]:
    """Bounds of a design for which none are given.

    Both ends of each rope in the plane of motion and the guide within REACH of where they are; the cuff's stiffnesses
    across and along the forearm within FACTOR. All are clipped to what a device can have whose other numbers stay.
    """
    found = {}
    for name, value in design.numbers().items():
        if name == "guide_distance" or (name.startswith("ropes.") and name.endswith((".0", ".1"))):
            found[name] = (value - REACH, value + REACH)
        elif name in ("cuff.stiffness.0", "cuff.stiffness.1") and value > 0.0:
            found[name] = (value / FACTOR, value * FACTOR)
    clipped = {name: (_clipped(design, name, low), _clipped(design, name, high)) for name, (low, high) in found.items()}
    return {name: (low, high) for name, (low, high) in clipped.items() if high - low >= _least_width(high)}


def _clipped(design: Design, name: str, end: float) -> float:
    """A bound, or the farthest on the way there from today's value that a device can have."""
    if _is_possible(design, name, end):
        return end
    inside, outside = design.numbers()[name], end
    for _ in range(CLIPPING):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if _is_possible(design, name, middle) else (inside, middle)
    return inside


def _is_possible(design: Design, name: str, value: float) -> bool:
    """Whether there can be a device with one number changed."""
    try:
        design.changed({name: value})
    except InputError:
        return False
    return True


def _least_width(value: float) -> float:
    """Least width of the bounds of a number."""
    return LEAST_WIDTH * max(1.0, abs(value))


class DesignSpace:
    """The designs within bounds around today's.

    Args:
        today: the design to begin at.
        bounds: least and largest value of each number that is designed; None: `usual_bounds`.

    Raises:
        InputError: an unknown number, bounds that are too narrow or leave out today's value, or an end of them at which
            there can be no such device.
    """

    def __init__(self, today: Design, bounds: Mapping[str, tuple[float, float]] | None = None) -> None:
        self.today = today
        found = usual_bounds(today) if bounds is None else dict(bounds)
        known = today.numbers()
        for name, (low, high) in found.items():
            _check(name, low, high, known)
            for end in (low, high):
                with said_of(f"bounds: {name} = {end:g}"):
                    today.changed({name: end})
        self.names = tuple(found)
        self.start = np.array([known[name] for name in found])
        """Today's values, shape (n,)."""
        self.low, self.high = np.array(list(found.values())).T

    def design(self, x: np.ndarray) -> Design:
        """The design with these values, shape (n,).

        Raises:
            InputError: there can be no such device.
        """
        return self.today.changed(dict(zip(self.names, x.tolist(), strict=True)))

    def at_bounds(self, x: np.ndarray) -> list[str]:
        """Names of the numbers that lie at a bound."""
        near = 1e-6 * (self.high - self.low)
        return [name for k, name in enumerate(self.names) if min(x[k] - self.low[k], self.high[k] - x[k]) <= near[k]]


def _check(name: str, low: float, high: float, known: Mapping[str, float]) -> None:
    """Refuse bounds of one number.

    Raises:
        InputError: names the number, its bounds, and what would be right.
    """
    if name not in known:
        more = "" if any(x.startswith("cuff.") for x in known) else " ('cuff. ...' only with a compliant cuff)"
        raise InputError(f"bounds: '{name}' is no number that can be designed. Expected one of {choices(known)}{more}.")
    if not high - low >= _least_width(known[name]):
        raise InputError(
            f"bounds: {name} = [{low:.9g}, {high:.9g}]: expected a least value below the largest, by at least "
            f"{_least_width(known[name]):g}."
        )
    if not low <= known[name] <= high:
        raise InputError(
            f"bounds: {name} = [{low:g}, {high:g}]: expected bounds with today's value, {known[name]:g}, between them."
        )

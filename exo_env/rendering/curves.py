"""Curves of a panel, of which those that would lie on another one are told in words instead.

Two curves lie on each other where they are apart by more than two lines' width for less than a tenth of the time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from exo_env.rendering.quantities import quantity

NEAR = 0.02
"""Distance within which curves cannot be told apart, as a share of what the panel spans [-]: two lines' width."""
SMALLEST = 0.01
"""Distances below are not told to the digit [unit of the quantity]."""
OFTEN = 0.1
"""Share of the time for which curves must be farther apart than that, to count as two [-]."""


@dataclass(frozen=True)
class Curve:
    """A quantity over time."""

    name: str
    """In words, for notes."""
    times: np.ndarray
    """[s], shape (n,)."""
    values: np.ndarray
    """Shape (n,)."""
    style: dict[str, Any] = field(default_factory=dict)
    """Colour, dashes and, where the legend shows it, label: arguments of matplotlib's plot."""


@dataclass(frozen=True)
class Twin:
    """A curve that lies on another one."""

    curve: Curve
    on: Curve
    apart: float
    """Largest distance of the two [unit of the quantity]."""


def told_apart(curves: Sequence[Curve], span: float | None = None) -> tuple[list[Curve], list[Twin]]:
    """Curves that can be told apart, in order, and those that lie on one of them.

    Args:
        curves: of one panel.
        span: of the panel's axis [unit of the quantity]; that of these curves where it is not given.
    """
    values = np.concatenate([c.values[np.isfinite(c.values)] for c in curves])
    width = float(np.ptp(values)) if span is None and values.size else span or 0.0
    drawn: list[Curve] = []
    twins: list[Twin] = []
    for curve in curves:
        distances = [(other, difference(curve, other)) for other in drawn]
        found = next((pair for pair in distances if _together(pair[1].values, width)), None)
        if found is None:
            drawn.append(curve)
        else:
            twins.append(Twin(curve, found[0], float(np.abs(found[1].values).max())))
    return drawn, twins


def _together(distances: np.ndarray, width: float) -> bool:
    """Whether a line of the figure hides such distances."""
    return bool(distances.size) and float(np.mean(np.abs(distances) > NEAR * width)) < OFTEN


def difference(curve: Curve, other: Curve) -> Curve:
    """A curve minus another one, as long as both last."""
    n = int(np.searchsorted(curve.times, other.times[-1] + 1e-9, side="right"))
    times = curve.times[:n]
    values = curve.values[:n] - np.interp(times, other.times, other.values)
    return Curve(f"{curve.name} - {other.name}", times, values, curve.style)


def draw(ax: Any, curves: Sequence[Curve]) -> None:
    """Draw all of them."""
    for curve in curves:
        ax.plot(curve.times, curve.values, **curve.style)


def told(twins: Sequence[Twin], unit: str) -> str:
    """Words on curves that are not drawn, such as "2 and 3 on 1 (at most 0.3 Nm apart)"; "" where there are none."""
    groups: dict[str, list[Twin]] = {}
    for twin in twins:
        groups.setdefault(twin.on.name, []).append(twin)
    said = []
    for on, ones in groups.items():
        *first, last = [one.curve.name for one in ones]
        names = f"{', '.join(first)} and {last}" if first else last
        apart = max(one.apart for one in ones)
        size = f"at most {quantity(apart, unit, 2)}" if apart >= SMALLEST else f"less than {quantity(SMALLEST, unit)}"
        said.append(f"{names} on {on} ({size} apart)")
    return "; ".join(said)

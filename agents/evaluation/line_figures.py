"""Figures with a line a policy: returns over the size of shifts, and over the windows with a new patient."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exo_env.rendering.panels import drawn, legend, literal, panels, save

from ..policies.policy import Policy
from .figure import COLOURS

MARKERS = "osD^vP*X"
COLUMNS = 4
"""Panels in a row at most."""


@dataclass(frozen=True)
class Curve:
    """A line of a panel."""

    title: str
    """Of the policy."""
    points: list[tuple[float, Mapping[str, Any]]]
    """Place on the axis, and the estimate there."""


@drawn
def draw_panels(path: Path, shown: Sequence[tuple[str, str, Sequence[Curve]]], whom: str) -> None:
    """Panels with lines and their intervals, lettered.

    Args:
        path: PNG file.
        shown: labels of both axes and curves of each panel.
        whom: over whom the intervals are.
    """
    columns = min(COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    figure, axes = panels(rows, columns, (max(3.3 * columns, 4.5), 2.9 * rows + 0.7))
    for k, (ax, (across, up, curves)) in enumerate(zip(axes.flat, shown, strict=False)):
        for i, curve in enumerate(curves):
            _line(ax, curve, COLOURS[i % len(COLOURS)], MARKERS[i % len(MARKERS)])
        ax.set_title(f"({chr(ord('a') + k)})", loc="left", fontsize=10, fontweight="bold")
        ax.set_xlabel(_wrapped(across), fontsize=8)
        ax.set_ylabel(up, fontsize=8)
        ax.tick_params(labelsize=8)
        ax.set_xticks([x for x, _ in curves[0].points], [f"{x:g}" for x, _ in curves[0].points])
    for ax in list(axes.flat)[len(shown) :]:
        ax.set_visible(False)
    legend(figure, axes.flat[0], 3)
    figure.supxlabel(literal(f"{whom}; bands: 95 % bootstrap intervals over the patients"), fontsize=8)
    save(figure, path)


def line_titles(policies: Sequence[Policy]) -> dict[str, str]:
    """What a legend calls each policy, by its name; the name too, where several have one title."""
    titles = [one.title for one in policies]
    return {p.name: p.title + (f" ({Path(p.name).name})" if titles.count(p.title) > 1 else "") for p in policies}


def _line(ax: Any, curve: Curve, colour: str, marker: str) -> None:
    """A line through the estimates, and a band of their intervals."""
    places = [x for x, _ in curve.points]
    value, low, high = ([e[key] for _, e in curve.points] for key in ("value", "low", "high"))
    ax.plot(places, value, color=colour, marker=marker, markersize=4, linewidth=1.4, label=literal(curve.title))
    ax.fill_between(places, low, high, color=colour, alpha=0.15, linewidth=0.0)


def _wrapped(label: str) -> str:
    """A label in two lines where it is long."""
    if len(label) <= 36 or " " not in label[:36]:
        return label
    at = label.rindex(" ", 0, 36)
    return f"{label[:at]}\n{label[at + 1 :]}"

"""Figures with a line a policy: returns over the size of shifts, and over the windows with a new patient."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dms_core.figures import drawn
from exo_env.rendering.panels import COLOURS, DASHES, legend, literal, note, panels, save

from ...policies.policy import Policy

MARKERS = "osD^vP*X"
COLUMNS = (3, 4)
"""Panels in a row, where there are more than four: as many as leave fewer places empty."""


@dataclass(frozen=True)
class Curve:
    """A line of a panel."""

    title: str
    """Of the policy."""
    points: list[tuple[float, Mapping[str, Any]]]
    """Place on the axis, and the estimate there."""


@drawn
def draw_panels(
    path: Path, shown: Sequence[tuple[str, str, Sequence[Curve]]], whom: str, sentences: Sequence[str] = ()
) -> None:
    """Panels with lines and their intervals.

    Args:
        path: PNG file.
        shown: labels of both axes and curves of each panel.
        whom: over whom the intervals are.
        sentences: on what is shown.
    """
    columns = min(COLUMNS, key=lambda c: (-len(shown) % c, -c)) if len(shown) > max(COLUMNS) else len(shown)
    rows = -(-len(shown) // columns)
    figure, axes = panels(rows, columns, (max(3.3 * columns, 4.5), 2.9 * rows + 0.7))
    for ax, (across, up, curves) in zip(axes.flat, shown, strict=False):
        for i, curve in enumerate(curves):
            _line(ax, curve, i)
        ax.set_xlabel(_wrapped(across), fontsize=8)
        ax.set_ylabel(up, fontsize=8)
        ax.tick_params(labelsize=8)
        ax.set_xticks([x for x, _ in curves[0].points], [f"{x:g}" for x, _ in curves[0].points])
    for ax in list(axes.flat)[len(shown) :]:
        ax.set_visible(False)
    legend(figure, 3)
    note(figure, [f"{whom}; bands: 95 % bootstrap intervals over the patients.", *sentences])
    save(figure, path)


def line_titles(policies: Sequence[Policy]) -> dict[str, str]:
    """What a legend calls each policy, by its name; the name too, where several have one title."""
    titles = [one.title for one in policies]
    return {p.name: p.title + (f" ({Path(p.name).name})" if titles.count(p.title) > 1 else "") for p in policies}


def _line(ax: Any, curve: Curve, k: int) -> None:
    """A line through the estimates, the k-th of its panel, and a band of their intervals."""
    places = [x for x, _ in curve.points]
    value, low, high = ([e[key] for _, e in curve.points] for key in ("value", "low", "high"))
    colour, dashes, marker = COLOURS[k % len(COLOURS)], DASHES[k % len(DASHES)], MARKERS[k % len(MARKERS)]
    ax.plot(
        places, value, color=colour, linestyle=dashes, marker=marker, markersize=4, linewidth=1.4,
        label=literal(curve.title),
    )  # fmt: skip
    ax.fill_between(places, low, high, color=colour, alpha=0.15, linewidth=0.0)


def _wrapped(label: str) -> str:
    """A label in two lines where it is long."""
    if len(label) <= 36 or " " not in label[:36]:
        return label
    at = label.rindex(" ", 0, 36)
    return f"{label[:at]}\n{label[at + 1 :]}"

"""What all figures of this project have in common: panels drawn by software (Agg), so that no display is needed."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dms_core.figures import put_letters, require_matplotlib, visible, write_figure

RESOLUTION = 150
"""Resolution of the figures [dots per inch]."""
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
"""Colours of curves in turn, distinct for colour-blind readers (Okabe and Ito 2008)."""
DASHES = ("-", "--", "-.", (0, (4, 1, 1, 1, 1, 1)))
"""Dashes of curves in turn; with seven colours the same line comes again after 28."""
DIVISIONS = ((2.5, (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)), (10.0, (1.0, 2.0, 5.0)), (300.0, (1.0, 3.0)))
"""Ratios of the ends of a logarithmic axis, and the places with labels in a decade up to each; beyond, its ends."""
LETTERS_AN_INCH = 14.0
"""Letters of a note that fit into an inch."""


def panels(rows: int, columns: int, size: tuple[float, float], **shared: Any) -> tuple[Any, Any]:
    """A figure of a size [inch] with axes, shape (rows, columns); `shared`: of matplotlib's Figure.subplots."""
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=RESOLUTION, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False, **shared)
    for ax in axes.flat:
        ax.grid(True, color="0.9", linewidth=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    return figure, axes


def legend(figure: Any, columns: int, order: Sequence[str] = ()) -> None:
    """Name the curves of all panels, each name once, above the panels, never on a curve.

    Args:
        figure: whose panels are drawn.
        columns: of the legend.
        order: names that come first, in this order.
    """
    found: dict[str, Any] = {}
    for ax in visible(figure):
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    names = [name for name in order if name in found] + [name for name in found if name not in order]
    if names:
        figure.legend(
            [found[name] for name in names], names, loc="outside upper center", ncols=columns, frameon=False, fontsize=8
        )


def note(figure: Any, sentences: Sequence[str]) -> None:
    """Sentences below the panels, of what is not drawn and why."""
    width = round(LETTERS_AN_INCH * figure.get_figwidth())
    lines = [line for sentence in sentences for line in textwrap.wrap(sentence, width)]
    if lines:
        figure.supxlabel(literal("\n".join(lines)), fontsize=8, color="0.25")


def log_scale(ax: Any, axis: str) -> None:
    """A logarithmic axis "x" or "y" with few plain numbers; call it when the curves are drawn."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    ax.set(**{f"{axis}scale": "log"})
    one = ax.xaxis if axis == "x" else ax.yaxis
    low, high = one.get_view_interval()
    places = next((places for ratio, places in DIVISIONS if high < ratio * low), (1.0,))
    one.set_major_locator(LogLocator(subs=places))
    one.set_major_formatter(StrMethodFormatter("{x:g}"))
    # Labels between these would be printed over each other in a small panel.
    one.set_minor_formatter(NullFormatter())


def _break_titles(figure: Any) -> None:
    """Break the titles of several panels where they are wider than their panel: beside it stand letters."""
    shown = visible(figure)
    titled = [ax for ax in shown if ax.get_title()] if len(shown) > 1 else []
    if titled:
        # Places and sizes of panels are known once they have been laid out.
        figure.draw_without_rendering()
    for ax in titled:
        fitting = ax.get_window_extent().width / ax.title.get_window_extent().width
        if fitting < 1.0:
            lines = ax.get_title().split("\n")
            width = max(int(fitting * max(map(len, lines))), 1)
            ax.title.set_text("\n".join(textwrap.fill(line, width, break_long_words=False) for line in lines))


def literal(text: str) -> str:
    """A text for a figure as it stands: in that of a user, $ begins no formula."""
    return text.replace("$", r"\$")


def save(figure: Any, path: Path) -> Path:
    """Write a picture whole or not at all, as its name ends; several panels get letters, which no title reaches."""
    _break_titles(figure)
    put_letters(figure)
    return write_figure(figure, path)

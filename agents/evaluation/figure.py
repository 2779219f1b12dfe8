"""The figure of an evaluation: a panel a measure, a row a policy, each episode a dot, estimate and interval above."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from exo_env.rendering.panels import drawn, literal, panels, save

from .measures import MEASURES
from .tables import heading, statistic

COLUMNS = 3
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Distinct for colour-blind readers (Okabe and Ito 2008)."""


@drawn
def draw(path: Path, results: dict[str, Any]) -> None:
    """Draw an evaluation as PNG, by software, whole or not at all."""
    policies = results["policies"]
    names = list(policies)
    shown = [m for m in MEASURES if all(m.name in p["summary"] for p in policies.values())]
    rows = -(-len(shown) // COLUMNS)
    figure, axes = panels(rows, COLUMNS, (9.0, rows * (0.9 + 0.4 * len(names))), sharey=True)
    for ax, m in zip(axes.flat, shown, strict=False):
        for k, name in enumerate(names):
            _row(ax, k, policies[name], m.name)
        ax.set_title(m.label if m.unit == "-" else f"{m.label} [{m.unit}]", fontsize=9)
        ax.set_yticks(range(len(names)), [literal(policies[n]["title"]) for n in names])
        ax.set_ylim(len(names) - 0.5, -0.5)
        ax.grid(False, axis="y")
        if m.unit == "deg":
            # An arm without help is off by a hundred times the error of a good device.
            ax.set_xscale("log")
            ax.xaxis.set_major_formatter("{x:g}")
    for ax in list(axes.flat)[len(shown) :]:
        ax.set_visible(False)
    figure.suptitle(f"{literal(heading(results))}\n{statistic(results)}", fontsize=9)
    save(figure, path)


def _row(ax: Any, k: int, policy: dict[str, Any], measure: str) -> None:
    """Patients and estimate of one policy."""
    values = np.array([e["measures"][measure] for e in policy["episodes"]])
    colour, e = COLOURS[k % len(COLOURS)], policy["summary"][measure]
    # Dots beside each other, in the order of the episodes.
    ax.plot(values, k + np.linspace(-0.25, 0.25, len(values)), ".", color=colour, alpha=0.35, markersize=4)
    ax.plot([e["low"], e["high"]], [k, k], color=colour, linewidth=2.0)
    ax.plot([e["value"]], [k], "o", color=colour, markersize=6, markeredgecolor="white")

"""The figure of an evaluation: a panel a measure, a row a policy, each episode a dot, estimate and interval above."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dms_core.figures import drawn
from exo_env.rendering.panels import COLOURS, literal, log_scale, note, panels, save
from exo_env.rendering.quantities import quantity

from ..episodes.measures import MEASURES, Measure
from ..results.tables import heading, statistic

COLUMNS = 3


@drawn
def draw(path: Path, results: dict[str, Any]) -> None:
    """Draw an evaluation as PNG, by software, whole or not at all."""
    policies = results["policies"]
    names = list(policies)
    known = [m for m in MEASURES if all(m.name in p["summary"] for p in policies.values())]
    equal = {m.label: quantity(values[0], m.unit) for m in known if np.ptp(values := _values(policies, m)) == 0.0}
    # A panel of dots on one line would show less than the number.
    shown = [m for m in known if m.label not in equal] or known[:1]
    rows = -(-len(shown) // COLUMNS)
    figure, axes = panels(rows, COLUMNS, (9.0, 1.1 + rows * (0.8 + 0.4 * len(names))), sharey=True)
    for ax, m in zip(axes.flat, shown, strict=False):
        for k, name in enumerate(names):
            _row(ax, k, policies[name], m.name)
        ax.set_title(m.label if m.unit == "-" else f"{m.label} [{m.unit}]", fontsize=9)
        ax.set_yticks(range(len(names)), [literal(policies[n]["title"]) for n in names])
        ax.set_ylim(len(names) - 0.5, -0.5)
        ax.grid(False, axis="y")
        if m.unit == "deg":
            # An arm without help is off by a hundred times the error of a good device.
            log_scale(ax, "x")
    for ax in list(axes.flat)[len(shown) :]:
        ax.set_visible(False)
    if equal:
        said = ", ".join(f"{label} {value}" for label, value in equal.items())
        note(figure, [f"The same in all episodes of all policies: {said}."])
    figure.suptitle(f"{literal(heading(results))}\n{statistic(results)}", fontsize=9)
    save(figure, path)


def _values(policies: dict[str, Any], measure: Measure) -> np.ndarray:
    """A measure of all episodes of all policies, those that could not be had left out; shape (n,), at least one."""
    values = np.array([e["measures"][measure.name] for p in policies.values() for e in p["episodes"]], dtype=float)
    finite = values[np.isfinite(values)]
    return finite if finite.size else np.zeros(1)


def _row(ax: Any, k: int, policy: dict[str, Any], measure: str) -> None:
    """Patients and estimate of one policy."""
    values = np.array([e["measures"][measure] for e in policy["episodes"]], dtype=float)
    colour, e = COLOURS[k % len(COLOURS)], policy["summary"][measure]
    # Dots beside each other, in the order of the episodes.
    ax.plot(values, k + np.linspace(-0.25, 0.25, len(values)), ".", color=colour, alpha=0.35, markersize=4)
    ax.plot([e["low"], e["high"]], [k, k], color=colour, linewidth=2.0)
    ax.plot([e["value"]], [k], "o", color=colour, markersize=6, markeredgecolor="white")

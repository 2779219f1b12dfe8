"""The figures of a report: learning curves, and what tracking costs in help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dms_core.errors import counted
from dms_core.figures import drawn
from exo_env.rendering.panels import COLOURS, legend, literal, log_scale, panels, save

CURVES = (
    ("return", "return of an episode"),
    ("tracking_rms_deg", "tracking error, rms [deg]"),
    ("device_work_share", "device's share of the work [-]"),
)
MARKERS = "osD^vP*X"
PARETO = ("device_work_share", "tracking_rms_deg")
FAR_OFF = 1.5
"""Errors beyond so many times the middle one are not compared patient by patient."""


@dataclass(frozen=True)
class Group:
    """Trainings that differ in nothing but their seed."""

    label: str
    curves: list[list[dict[str, Any]]]
    """Evaluations of each seed."""


@drawn
def learning_curves(path: Path, groups: Sequence[Group]) -> None:
    """Mean over the seeds and, as a band, the lowest to the highest of them."""
    first = next((e for group in groups for curve in group.curves for e in curve), {})
    shown = [(name, label) for name, label in CURVES if name in first]
    figure, axes = panels(1, len(shown), (3.4 * len(shown), 3.4), sharex="col")
    steps_in, word = _steps_in(groups)
    for ax, (name, label) in zip(axes.flat, shown, strict=True):
        for k, group in enumerate(groups):
            steps, values = on_common_steps(group.curves, name)
            colour, n = COLOURS[k % len(COLOURS)], len(group.curves)
            seeds = f"{n} seed{'s' * (n > 1)}"
            steps = steps / steps_in
            ax.plot(steps, values.mean(axis=0), color=colour, marker=".", label=literal(f"{group.label} ({seeds})"))
            ax.fill_between(steps, values.min(axis=0), values.max(axis=0), color=colour, alpha=0.2, linewidth=0.0)
        ax.set_xlabel(f"decisions{word}")
        ax.set_ylabel(label)
    legend(figure, 4)
    save(figure, path)


def _steps_in(groups: Sequence[Group]) -> tuple[float, str]:
    """What the decisions are counted in, and its word for the axis."""
    most = max((e["steps"] for group in groups for curve in group.curves for e in curve), default=0)
    scales = ((1e6, " [million]"), (1e3, " [thousand]"), (1.0, ""))
    return next((scale, word) for scale, word in scales if most >= scale or scale == 1.0)


def on_common_steps(curves: Sequence[Sequence[Mapping[str, Any]]], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Curves at the steps of all of them, up to the end of the shortest.

    Returns:
        Steps, shape (m,), and values, shape (curves, m); what could not be measured is bridged.
    """
    kept = [[(e["steps"], e[name]) for e in curve if e.get(name) is not None] for curve in curves]
    kept = [pairs for pairs in kept if pairs]
    if not kept:
        return np.zeros(0), np.zeros((1, 0))
    end, begin = min(pairs[-1][0] for pairs in kept), max(pairs[0][0] for pairs in kept)
    steps = np.array(sorted({s for pairs in kept for s, _ in pairs if begin <= s <= end}), dtype=float)
    columns = [np.array(pairs, dtype=float).T for pairs in kept]
    return steps, np.array([np.interp(steps, x, y) for x, y in columns])


@drawn
def pareto(path: Path, results: Mapping[str, Any]) -> None:
    """Tracking over the share of the work that the device does: low is good in both, and one costs the other.

    Beside it the same as differences to the first policy, patient by patient, of those that track nearly as well:
    patients differ by more than policies do.
    """
    policies = list(results["policies"].values())
    errors = [p["summary"][PARETO[1]]["value"] for p in policies]
    near = [p for p, error in zip(policies, errors, strict=True) if error <= FAR_OFF * float(np.median(errors))]
    compared = len(near) > 1 and policies[0] in near
    figure, axes = panels(1, 1 + compared, (5.2 + 4.2 * compared, 4.4))
    ax = axes.flat[0]
    _points(ax, policies, policies, "summary")
    _front(ax, policies)
    log_scale(ax, "y")
    ax.grid(True, which="minor", axis="y", color="0.94", linewidth=0.4)
    ax.set_xlabel("share of the device in the positive work [-]")
    ax.set_ylabel("tracking error, rms [deg]")
    ax.set_title("interquartile means; low is good in both, dotted: beaten by none", fontsize=9)
    if compared:
        other = axes.flat[1]
        _points(other, near, policies, "difference")
        other.locator_params(axis="x", nbins=6)
        other.set_xlabel("share of the device: difference [-]")
        other.set_ylabel("tracking error, rms: difference [deg]")
        left_out = [p["title"] for p in policies if p not in near]
        what = f"mean difference to {policies[0]['title']}, patient by patient"
        other.set_title(literal(what + (f"\n(far off: {', '.join(left_out)})" if left_out else "")), fontsize=9)
    percent = 100.0 * results["confidence"]
    whom = f"{counted(results['patients'], 'patient')}, {results['population']}; {percent:g} % intervals"
    figure.supxlabel(literal(whom), fontsize=9)
    legend(figure, 3)
    save(figure, path)


def _points(ax: Any, shown: Sequence[Mapping[str, Any]], policies: Sequence[Mapping[str, Any]], kind: str) -> None:
    """A point with whiskers a policy; trainings that are shown together are dots of that colour without whiskers."""
    x, y = PARETO
    alone = [p for p in policies if _pool(p, policies) is None]
    for p in shown:
        one, other = p[kind][x], p[kind][y]
        pool = _pool(p, policies)
        k = alone.index(pool or p)
        colour, marker = COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)]
        if pool is not None:
            ax.plot(one["value"], other["value"], ".", color=colour, markersize=4, zorder=3)
            continue
        # A percentile interval of few patients may lie beside its value.
        whiskers = [[[max(v["value"] - v["low"], 0.0)], [max(v["high"] - v["value"], 0.0)]] for v in (one, other)]
        ax.errorbar(
            one["value"], other["value"], xerr=whiskers[0], yerr=whiskers[1], color=colour, marker=marker, markersize=6,
            linewidth=1.2, capsize=3, linestyle="", label=literal(p["title"]), alpha=0.8,
        )  # fmt: skip


def _pool(policy: Mapping[str, Any], policies: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """The trainings with which a policy is shown together, or None."""
    return next((p for p in policies if policy["title"] in p.get("of", ())), None)


def _front(ax: Any, policies: Sequence[Mapping[str, Any]]) -> None:
    """A line along the policies that none other beats in both."""
    points = [[p["summary"][name]["value"] for name in PARETO] for p in policies]
    best = sorted(p for p in points if not any(q[0] <= p[0] and q[1] <= p[1] and q != p for q in points))
    ax.step(*zip(*best, strict=True), where="post", color="0.7", linewidth=1.0, linestyle=":", zorder=0)

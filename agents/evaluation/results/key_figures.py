"""The figures that every table of a task with a hidden plan gives: of a policy with some patients, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...policies.policy import Policy
from ..comparison.evaluate import Case, Plan, each_episode_of, summary
from ..comparison.gap import GAP, gap_closed
from ..comparison.statistics import Estimate
from ..episodes.measures import MEASURES
from .tables import cell, gap_cell

MEASURED = ("return", "tracking_rms_deg", "device_work_share", "opposing_power_W", "unsafe")
"""Measures that are kept of an episode."""
FIGURES = ("return", GAP, *MEASURED[1:])
"""Columns of a table, each an estimate with its interval."""
HEADS = {m.name: m.label if m.unit == "-" else f"{m.label} [{m.unit}]" for m in MEASURES if m.name in MEASURED}
HEADS |= {GAP: "gap closed"}
MEANS = (
    "Interquartile means over the patients; of the gap closed and of unsafe episodes means [95 % bootstrap interval]."
)
"""What the cells of such a table are."""


def measured_episodes(one: Policy, plan: Plan, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """Seed and measures of each episode."""
    return [
        {"seed": e["seed"], "measures": {name: e["measures"].get(name) for name in MEASURED}}
        for e in each_episode_of(one, plan, cases)
    ]


def key_figures(
    episodes: list[dict[str, Any]], opponent: list[dict[str, Any]], oracle: list[dict[str, Any]], seed: int,
    trainings: int = 1,
) -> dict[str, dict[str, Any]]:  # fmt: skip
    """The figures of a policy, by name.

    Args:
        episodes: of the policy, or of several trainings one after another.
        opponent: of its opponent with the same patients.
        oracle: of the oracle with the same patients.
        seed: of the bootstrap.
        trainings: how many.
    """
    gap = gap_closed(episodes, opponent, oracle, seed, trainings)
    return {**summary(episodes, seed, trainings, MEASURED), GAP: gap}


def cells(found: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Texts of the figures for a table of Markdown."""
    return [gap_cell(found) if name == GAP else cell(Estimate(**found[name])) for name in FIGURES]


def columns(found: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """The figures for a table of numbers, each with both ends of its interval; empty where there is none."""
    row = {}
    for name in FIGURES:
        for end, column in (("value", name), ("low", f"{name}_low"), ("high", f"{name}_high")):
            number = found.get(name, {}).get(end)
            row[column] = "" if number is None or number != number else f"{number:.5g}"
    return row

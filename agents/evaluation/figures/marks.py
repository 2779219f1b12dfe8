"""Marks of an episode in a panel over time: when the load changed, and when an event ended it."""

from __future__ import annotations

from typing import Any

from exo_env.rendering.quantities import fixed

from ..episodes.time_course import TimeCourse

GONE = "0.92"
"""Grey of the time that an episode did not live to see."""


def mark_load_steps(ax: Any, one: TimeCourse, *, say: bool = False) -> None:
    """A dotted line where the load changed; `say` writes above the panel by how much."""
    for time, change in one.load_steps:
        ax.axvline(time, color="0.35", linestyle=":", linewidth=1.0, zorder=1)
        if say:
            ax.annotate(
                f"{fixed(change, 1, sign=True)} kg", (time, 1.0), xytext=(0.0, 2.0), xycoords=("data", "axes fraction"),
                textcoords="offset points", ha="center", va="bottom", fontsize=7, color="0.35",
            )  # fmt: skip


def mark_end(ax: Any, one: TimeCourse, reading: str, colour: str, factor: float = 1.0) -> None:
    """A cross where an event ended an episode, on the curve of a reading times a factor."""
    values = one.columns.get(reading)
    if one.event is not None and values is not None:
        end = one.columns["time"][-1], factor * float(values[-1])
        ax.plot(*end, "x", color=colour, markersize=9, markeredgewidth=2.5)


def end_sentence(one: TimeCourse) -> str:
    """How an episode ended early; "" where none did."""
    return "" if one.event is None else f"{one.policy} ended at {one.columns['time'][-1]:.1f} s (cross): {one.event}"

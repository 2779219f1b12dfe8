"""The picture of one patient under several policies: what was wanted and done, and who gave the moment for it."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dms_core.figures import drawn
from exo_env.rendering.panels import COLOURS, legend, literal, note, panels, save

from ..episodes.time_course import TimeCourse
from .marks import GONE, end_sentence, mark_end, mark_load_steps
from .patients_figure import ANGLE, wanted_curve

ARM, DEVICE, MUSCLES = COLOURS[:3]
LETTERS = 32
"""Letters of a policy's title in a line."""
NEEDED = (ANGLE, "reference", "exo_moment", "muscle_moment")
"""Readings that the picture is made of."""


@drawn
def policy_picture(path: Path, ones: Sequence[TimeCourse], whom: str) -> None:
    """Draw a column for each policy: flexion above, moments below.

    Args:
        path: as which picture, by its ending.
        ones: the same episode under each policy, with the readings of NEEDED.
        whom: words that name the patient.
    """
    figure, axes = panels(2, len(ones), (1.0 + 2.8 * len(ones), 5.2), sharex="all", sharey="row", height_ratios=(3, 2))
    end = max(one.columns["time"][-1] for one in ones)
    plan = wanted_curve(max(ones, key=lambda one: len(one.columns["time"])))
    for (above, below), one in zip(axes.T, ones, strict=True):
        above.plot(plan.times, plan.values, zorder=3, **plan.style)
        _flexion(above, one)
        _moments(below, one)
        mark_load_steps(above, one, say=True)
        mark_load_steps(below, one)
        if one.event is not None:
            for ax in (above, below):
                ax.axvspan(one.columns["time"][-1], end, color=GONE, linewidth=0.0, zorder=0)
        above.set_title(literal(f"{textwrap.fill(one.policy, LETTERS)}\n{in_words(one)}"), fontsize=9, pad=14)
        below.set_xlabel("time [s]")
    axes[0, 0].set_ylabel("elbow flexion [deg]")
    axes[1, 0].set_ylabel("moment at\nthe elbow [Nm]")
    axes[0, 0].set_xlim(0.0, end)
    stepped = "; dotted: the load changes, without notice" if any(one.load_steps for one in ones) else ""
    ends = [sentence for one in ones if (sentence := end_sentence(one))]
    note(figure, [f"{whom}: {ones[0].who}{stepped}.", *ends])
    legend(figure, 4)
    save(figure, path)


def _flexion(ax: Any, one: TimeCourse) -> None:
    """The arm over what is wanted; what lies between them is shaded."""
    times, angle = one.columns["time"], np.degrees(one.columns[ANGLE])
    ax.fill_between(times, np.degrees(one.columns["reference"]), angle, color=ARM, alpha=0.15, linewidth=0.0)
    ax.plot(times, angle, color=ARM, linewidth=1.8, label="arm")
    mark_end(ax, one, ANGLE, ARM, 180.0 / np.pi)


def _moments(ax: Any, one: TimeCourse) -> None:
    """Moments of device and muscles, their areas shaded."""
    ax.axhline(0.0, color="0.6", linewidth=0.6, zorder=0)
    for name, label, colour in (("exo_moment", "device", DEVICE), ("muscle_moment", "muscles", MUSCLES)):
        times, moment = one.columns["time"], one.columns[name]
        ax.fill_between(times, 0.0, moment, color=colour, alpha=0.15, linewidth=0.0)
        ax.plot(times, moment, color=colour, linewidth=1.4, label=f"moment of the {label}")


def in_words(one: TimeCourse) -> str:
    """Share of the device and tracking error."""
    share = one.measures["device_work_share"]
    gives = "nobody moves" if math.isnan(share) else f"device does {100.0 * share:.0f} % of the work"
    return f"{gives}\n{one.measures['tracking_rms_deg']:.1f} deg off the {one.wanted} (rms)"

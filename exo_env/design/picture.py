"""Today's device and the found one side by side, across the plane of motion, and their ropes' moment arms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from dms_core.figures import drawn
from exo_env.design.space import Design
from exo_env.ecosystem.exoskeleton import LEAST_ANGLE, MOST_ANGLE
from exo_env.rendering.panels import COLOURS, legend, literal, note, panels, save
from exo_env.rendering.shapes import limb

SHOWN = 60.0
"""Elbow angle of the pictures [deg]."""
HUMERUS, FOREARM = 0.26, 0.25
"""Parts of the arm that are drawn from the elbow on [m]; for the eye only."""
SIZE = (9.6, 4.0)
"""Of the figure [inch]."""


def turned(point: Any) -> np.ndarray:
    """A point of the lower link in axes of the upper one at SHOWN, in the plane of motion, shape (2,)."""
    c, s = math.cos(math.radians(SHOWN)), math.sin(math.radians(SHOWN))
    return np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])


@drawn
def draw(path: Path, today: Design, found: Design) -> Path:
    """Draw both devices and their moment arms, and write the picture as its name ends."""
    figure, axes = panels(1, 3, SIZE)
    for ax, title, design, other in ((axes[0, 0], "today", today, found), (axes[0, 1], "found", found, today)):
        _device(ax, design, other)
        ax.set_title(title, fontsize=10)
    _levers(axes[0, 2], today, found)
    ends = np.concatenate([_ends(d, r) for d in (today, found) for r in d.device.ropes])
    low, high = np.minimum(ends.min(axis=0), -0.08) - 0.12, np.maximum(ends.max(axis=0), 0.24) + 0.05
    for ax in axes[0, :2]:
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="forward [m]", aspect="equal")
    axes[0, 0].set_ylabel("up, along the upper arm [m]")
    legend(figure, 4)
    said = "Dotted: in a and b the ropes of the other device, in c those of today's."
    note(figure, [f"{said} Numbers are x and y [mm] in the link that holds the end."])
    return save(figure, path)


def _ends(design: Design, rope: str) -> np.ndarray:
    """Both ends of a rope in the picture, shape (2, 2)."""
    r = design.device.ropes[rope]
    return np.array([r.upper[:2], turned(r.lower)])


def _device(ax: Any, design: Design, other: Design) -> None:
    """Arm, links and ropes; where the other device has its ropes, thin lines."""
    elbow = np.zeros(2)
    ax.set_axisbelow(True)
    for outline in (
        limb(np.array([0.0, HUMERUS]), elbow, 0.045, 0.038),
        limb(elbow, turned((0.0, -FOREARM, 0.0)), 0.036, 0.024),
    ):
        ax.fill(*outline.T, color="0.93", zorder=0)
    guide = turned((0.0, -design.device.guide_distance, 0.0))
    ax.plot(*np.array([(0.0, 0.2), elbow, guide]).T, color="0.55", linewidth=3, zorder=1, solid_capstyle="round")
    ax.plot(*guide, "s", color="0.35", markersize=7, zorder=4, label="guide or cuff")
    ax.plot(*elbow, "o", color="0.35", markersize=6, zorder=4, label="hinge")
    for k, rope in enumerate(design.device.ropes):
        colour, ends = COLOURS[k % len(COLOURS)], _ends(design, rope)
        ax.plot(*np.array([elbow, ends[1]]).T, color="0.55", linewidth=1.5, zorder=1)
        ax.plot(*_ends(other, rope).T, ":", color=colour, linewidth=1.0, zorder=2)
        ax.plot(*ends.T, "-o", color=colour, linewidth=2, markersize=5, zorder=5, label=literal(f"rope '{rope}'"))
        sides = (1.0, "left") if k == 0 else (-1.0, "right")
        for point, end in zip((design.device.ropes[rope].upper, design.device.ropes[rope].lower), ends, strict=True):
            # Adding 0 keeps a minus from a rounded nothing.
            x, y = (round(1e3 * value) + 0 for value in point[:2])
            ax.annotate(
                f"({x}, {y})", end, xytext=(7.0 * sides[0], 5.0), textcoords="offset points", fontsize=7, color=colour,
                ha=sides[1], zorder=6, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.7},
            )  # fmt: skip


def _levers(ax: Any, today: Design, found: Design) -> None:
    """Moment arm of each rope over the hinge angle."""
    angles = np.arange(LEAST_ANGLE, MOST_ANGLE + 1)
    for design, style in ((today, ":"), (found, "-")):
        for k, rope in enumerate(design.device.ropes):
            arm = [1e3 * design.device.moment_arm(rope, math.radians(a)) for a in angles]
            ax.plot(angles, arm, style, color=COLOURS[k % len(COLOURS)], linewidth=1.8 if style == "-" else 1.2)
    ax.axhline(0.0, color="0.7", linewidth=0.8)
    ax.set_title("moment arms of the ropes", fontsize=10)
    ax.set(xlabel="hinge angle [deg]", ylabel="moment arm, flexion positive [mm]")

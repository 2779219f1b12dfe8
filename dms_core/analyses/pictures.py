"""Stick figures of a model: where it rests, and how its modes move it.

A body is the outline of the points at which joints, springs, ropes and muscles hold it, and of its centre of mass; a
path or a spring is a thin line. Everything is seen along the direction in which the model is flattest. A mode is drawn
as large as it can be seen, brought back onto the constraints, so that joints stay together.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dms_core.analyses.linearise import Linearisation, Mode
from dms_core.analyses.motion_names import rotate
from dms_core.assembly.model import Model
from dms_core.errors import InputError
from dms_core.figures import FORMATS, drawn, put_letters, write_figure
from dms_core.model.element import GROUND
from dms_core.model.geometry.path import PathPoint

RESOLUTION = 130
"""[dots per inch]"""
LARGEST, CLOSINGS = 0.08, 8
"""Amplitude of a drawn mode over the size of the model, and steps that bring it back onto the constraints."""
MOST = 8
"""Modes in one picture: the slowest that move a body."""
REST, FORTH, BACK, CORD = "#9AA0A6", "#0072B2", "#D55E00", "#C9A227"

Lines = list[tuple[str, np.ndarray]]
"""(body, or '' for a cord) and the points of each, shape (k, 3)."""


def attachments(model: Model) -> dict[str, list[np.ndarray]]:
    """Points of each body at which something holds it, from its centre of mass [m]."""
    system, found = model.system, {body.name: [np.zeros(3)] for body in model.system.bodies}
    for call in model.layout.constraints:
        points = getattr(call.element, "own_points", ())
        for body, place in zip(call.placement.bodies, points, strict=False):
            if body in found and len(call.placement.numbers) >= place + 3:
                found[body].append(np.array(call.placement.numbers[place : place + 3]))
    for name, point in (p for cord in _cords(model) for p in cord):
        if name in found:
            found[name].append(system.arm(name, point))
    return {name: _distinct(points) for name, points in found.items()}


def _distinct(points: list[np.ndarray]) -> list[np.ndarray]:
    """Each point once."""
    kept: list[np.ndarray] = []
    for p in points:
        if all(np.linalg.norm(p - k) > 1e-9 for k in kept):
            kept.append(p)
    return kept


def _cords(model: Model) -> list[list[tuple[str, Any]]]:
    """Paths of ropes and muscles, and springs between two points: (body, point in its frame) along each."""
    found = []
    for element in (*model.system.forces, *model.system.constraints):
        path = getattr(element, "path", None)
        if isinstance(path, tuple) and path and isinstance(path[0], PathPoint):
            found.append([(p.body, p.point) for p in path])
        elif hasattr(element, "free_length"):
            found.append([(element.body_i, element.point_i), (element.body_j, element.point_j)])
    return found


def lines(model: Model, q: np.ndarray) -> Lines:
    """Lines of the figure at a position, in ground axes [m]."""
    found: Lines = []
    for name, points in attachments(model).items():
        found.append((name, np.array([_placed(model, q, name, p) for p in points])))
    for cord in _cords(model):
        found.append(("", np.array([_placed(model, q, b, model.system.arm(b, p)) for b, p in cord])))
    return found


def _placed(model: Model, q: np.ndarray, body: str, arm: np.ndarray) -> np.ndarray:
    """A point of a body in ground axes [m]."""
    if body == GROUND:
        return np.asarray(arm, float)
    k = model.layout.offset[body]
    if not model.system.body(body).rigid:  # type: ignore[union-attr]
        return q[k : k + 3] + arm
    p = q[k + 3 : k + 7] / np.linalg.norm(q[k + 3 : k + 7])
    return q[k : k + 3] + rotate(p, np.asarray(arm, float))


def view(figure: Lines) -> np.ndarray:
    """Axes of the picture, rows right and up: the two ground axes along which the figure is widest."""
    points = np.concatenate([p for _, p in figure])
    wide = np.sort(np.argsort(-np.ptp(points, axis=0), kind="stable")[:2])
    if 1 in wide:
        right = next((k for k in wide if k != 1), 0)
        return np.eye(3)[[right, 1]]
    return np.eye(3)[wide]


def figure_size(figure: Lines) -> float:
    """Longest extent [m]."""
    points = np.concatenate([p for _, p in figure])
    return float(np.ptp(points, axis=0).max()) or 1.0


@drawn
def draw_modes(path: Path, linear: Linearisation, modes: Sequence[Mode] | None = None) -> Path:
    """Write a picture of mode shapes: at rest in grey, and at both ends of the swing.

    Args:
        path: PNG, SVG or PDF.
        linear: the linear system.
        modes: that are drawn; default: the slowest that move a body.

    Raises:
        InputError: the ending is of no picture, or no mode moves a body.
    """
    if path.suffix not in FORMATS:
        raise InputError(f"picture '{path}': Expected a name that ends with {', '.join(FORMATS)}.")
    shown = [m for m in (modes if modes is not None else linear.modes()) if _sway(linear, m) > 0.0][:MOST]
    if not shown:
        raise InputError("no mode of this model moves a body; there is nothing to draw.")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    across = min(4, len(shown))
    down = -(-len(shown) // across)
    sheet = Figure(figsize=(3.1 * across, 3.3 * down), dpi=RESOLUTION, layout="constrained")
    FigureCanvasAgg(sheet)
    panels = sheet.subplots(down, across, squeeze=False)
    for ax, mode in zip(panels.flat, shown, strict=False):
        _draw(ax, linear, mode)
    for ax in list(panels.flat)[len(shown) :]:
        ax.set_visible(False)
    _legend(sheet)
    put_letters(sheet)
    return write_figure(sheet, path)


def _legend(sheet: Any) -> None:
    """Name the colours, above the panels."""
    from matplotlib.lines import Line2D

    names = {"at rest": REST, "one end of the swing": FORTH, "its other end": BACK}
    sheet.legend(
        handles=[Line2D([], [], color=colour, label=name) for name, colour in names.items()],
        loc="outside upper center", ncols=3, frameon=False, fontsize=8,
    )  # fmt: skip


def _sway(linear: Linearisation, mode: Mode) -> float:
    """Largest way of a point over the mode's amplitude [m]; 0 where only element states change."""
    model, q = linear.model, linear.point.q
    h = 1e-4
    dq = np.where(np.arange(model.n_q) < model.layout.of_bodies, mode.shape.real, 0.0)
    rest, moved = lines(model, q), lines(model, q + h * dq)
    way = max(float(np.abs(b - a).max()) for (_, a), (_, b) in zip(rest, moved, strict=True)) / h
    return way if way > 1e-6 * float(np.abs(mode.shape).max()) else 0.0


def _draw(ax: Any, linear: Linearisation, mode: Mode) -> None:
    """One panel."""
    model, q = linear.model, linear.point.q
    rest = lines(model, q)
    axes, amplitude = view(rest), LARGEST * figure_size(rest) / _sway(linear, mode)
    for sign, colour, depth in ((-1.0, BACK, 2), (1.0, FORTH, 3)):
        moved = closed_again(model, q, q + sign * amplitude * mode.shape.real)
        _stroke(ax, lines(model, moved), axes, colour, depth)
    _stroke(ax, rest, axes, REST, 1)
    swing = f"{mode.damped_frequency:.3g} Hz" if mode.damped_frequency else f"{mode.time_constant:.3g} s"
    ax.set_title(f"{swing}\ndamping ratio {mode.damping:.3g}", fontsize=9)
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.margins(0.08)


def closed_again(model: Model, rest: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The position q brought back to where constraints are as open as at rest, by steps of least norm."""
    if not model.n_phi:
        return q
    known = model.constraint_jacobian(rest)[0]
    for _ in range(CLOSINGS):
        phi, _, G, _ = model.constraint_jacobian(q)
        q = q - np.linalg.lstsq(G, phi - known, rcond=1e-10)[0]
    return q


def _stroke(ax: Any, figure: Lines, axes: np.ndarray, colour: str, depth: int) -> None:
    """Draw a figure: bodies as outlines, cords as thin lines."""
    for body, points in figure:
        flat = points @ axes.T
        if not body:
            cord = CORD if colour == REST else colour
            ax.plot(*flat.T, "-", color=cord, linewidth=0.5, alpha=0.5, zorder=depth)
            continue
        corners = outline(flat)
        if len(corners) == 1:
            ax.plot(*corners.T, "o", color=colour, markersize=5, zorder=depth)
            continue
        ax.fill(*corners.T, facecolor=colour, alpha=0.12, zorder=depth)
        ax.plot(*np.vstack([corners, corners[:1]]).T, "-", color=colour, linewidth=1.4, zorder=depth)


def outline(points: np.ndarray) -> np.ndarray:
    """Corners of the convex hull of points in a plane, shape (k, 2): one for a point, two for a line.

    Monotone chain (Andrew 1979).
    """
    size = float(np.ptp(points, axis=0).max(initial=0.0))
    if size < 1e-9:
        return points[:1]
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]
    halves = []
    for row in (ordered, ordered[::-1]):
        half: list[np.ndarray] = []
        for p in row:
            while len(half) > 1 and _turn(half[-2], half[-1], p) <= 1e-9 * size * size:
                half.pop()
            half.append(p)
        halves += half[:-1]
    return np.array(halves)


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Twice the area of a triangle, positive to the left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))

"""A square or a strip to draw on with pygame: shapes in fine pixels that are averaged down, then words over them.

Lengths of the layout (widths, radii, boxes) are given for a width of 480 pixels and grow with it; points of polygons
and lines are in fine pixels, which are `FINER` times smaller than those of the result.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal, get_args

import numpy as np

from dms_core.errors import DmsError, extra

Colour = tuple[int, int, int]
Alignment = Literal["left", "centre", "right"]
ALIGNMENTS: tuple[Alignment, ...] = get_args(Alignment)
Box = tuple[float, float, float, float]
"""x, y, width, height of a part of the layout."""
DESIGN = 480.0
"""Width for which lengths of the layout are given [pixel]."""
FINER = 2
"""Fine pixels per pixel of the result, along a side: the averages smooth all edges."""
FONT_HEIGHTS = {"small": 14, "normal": 16}
"""Heights of the words, in lengths of the layout."""
PROMPT = "PYGAME_HIDE_SUPPORT_PROMPT"


def import_pygame() -> Any:
    """The module pygame, without the greeting that it prints; the environment variables stay as they were.

    Raises:
        DmsError: pygame-ce is not installed.
    """
    before = os.environ.get(PROMPT)
    os.environ[PROMPT] = "1"
    try:
        import pygame
        import pygame.font
    except ImportError:
        raise DmsError(f"rendering needs pygame-ce. {extra('pictures')}") from None
    finally:
        if before is None:
            del os.environ[PROMPT]
        else:
            os.environ[PROMPT] = before
    return pygame


class Canvas:
    """The square or strip.

    Args:
        size: width of the result [pixel].
        height: of the result [pixel]; a square where it is not given.
    """

    def __init__(self, size: int, height: int | None = None) -> None:
        self.pygame = import_pygame()
        self.size, self.height, self.zoom = size, height or size, size / DESIGN
        self.unit = FINER * self.zoom
        self._fine = self.pygame.Surface((FINER * size, FINER * self.height), 0, 32)
        self._result = self.pygame.Surface((size, self.height), 0, 32)
        self.pygame.font.init()
        # The font that pygame brings along, so that pictures are the same on all machines.
        self._fonts = {k: self.pygame.font.Font(None, max(round(h * self.zoom), 6)) for k, h in FONT_HEIGHTS.items()}

    def clear(self, colour: Colour) -> None:
        """Begin a picture: fill everything with a colour."""
        self._fine.fill(colour)

    def polygon(self, outline: np.ndarray, colour: Colour, edge: Colour | None = None, width: float = 0.0) -> None:
        """A filled polygon, shape (n, 2), with a border of a width outside it."""
        if edge is not None:
            self.line(np.concatenate([outline, outline[:1]]), edge, 2.0 * width)
        self.pygame.draw.polygon(self._fine, colour, outline.tolist())

    def veil(self, outline: np.ndarray, colour: Colour, opacity: float) -> None:
        """A translucent polygon, shape (n, 2)."""
        low = np.floor(outline.min(axis=0))
        width, height = (np.ceil(outline.max(axis=0)) - low + 1).astype(int).tolist()
        glass = self.pygame.Surface((width, height), self.pygame.SRCALPHA, 32)
        self.pygame.draw.polygon(glass, (*colour, round(255 * opacity)), (outline - low).tolist())
        self._fine.blit(glass, low.tolist())

    def line(self, points: np.ndarray, colour: Colour, width: float) -> None:
        """A polyline, shape (n, 2), with round joints and ends."""
        radius = 0.5 * width * self.unit
        step = np.diff(points, axis=0)
        length = np.hypot(step[:, 0], step[:, 1])
        across = radius * np.column_stack([-step[:, 1], step[:, 0]]) / np.maximum(length, 1e-9)[:, None]
        a, b = points[:-1], points[1:]
        for corners in np.stack([a + across, b + across, b - across, a - across], axis=1).tolist():
            self.pygame.draw.polygon(self._fine, colour, corners)
        for point in points.tolist():
            self.pygame.draw.circle(self._fine, colour, point, radius)

    def disc(self, centre: np.ndarray, radius: float, colour: Colour) -> None:
        """A filled circle about a point, shape (2,)."""
        self.pygame.draw.circle(self._fine, colour, centre.tolist(), radius * self.unit)

    def box(self, box: Box, colour: Colour, *, border: Colour | None = None, round_by: float = 0.0) -> None:
        """A filled rectangle of the layout with round corners."""
        rectangle = self.pygame.Rect(*(round(self.unit * x) for x in box))
        corner = round(self.unit * round_by)
        self.pygame.draw.rect(self._fine, colour, rectangle, border_radius=corner)
        if border is not None:
            self.pygame.draw.rect(self._fine, border, rectangle, width=round(self.unit), border_radius=corner)

    @contextmanager
    def inside(self, box: Box) -> Iterator[None]:
        """Draw within a rectangle of the layout only."""
        self._fine.set_clip(self.pygame.Rect(*(round(self.unit * x) for x in box)))
        try:
            yield
        finally:
            self._fine.set_clip(None)

    def smooth(self) -> None:
        """Average the fine pixels; words come after this, shapes before."""
        self.pygame.transform.smoothscale(self._fine, (self.size, self.height), self._result)

    def words(
        self,
        text: str,
        at: tuple[float, float],
        colour: Colour,
        font: str = "normal",
        align: Alignment = "left",
        width: float = np.inf,
    ) -> None:
        """A line of text; `at` is its left, central or right upper point in the layout; cut where it is wider."""
        shown, f = text, self._fonts[font]
        while f.size(shown)[0] > width * self.zoom and len(shown) > 2:
            shown = shown[:-2] + "\u2026"
        picture = f.render(shown, True, colour)
        shift = 0.5 * ALIGNMENTS.index(align) * picture.get_width()
        self._result.blit(picture, (round(at[0] * self.zoom - shift), round(at[1] * self.zoom)))

    @property
    def result(self) -> Any:
        """The finished surface; the next picture is drawn on the same."""
        return self._result

    def pixels(self) -> np.ndarray:
        """A copy of the result: red, green, blue; uint8, shape (height, size, 3)."""
        data = self.pygame.image.tobytes(self._result, "RGB")
        return np.frombuffer(data, dtype=np.uint8).reshape(self.height, self.size, 3).copy()

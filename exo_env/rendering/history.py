"""What happened so far, as a strip below the picture of an episode: flexion, moments, effort, all over time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from exo_env.rendering.canvas import Canvas, Colour
from exo_env.rendering.picture import FRAME, GREY, INK, PAPER, REFERENCE
from exo_env.rendering.quantities import fixed
from exo_env.rendering.scene import Scene

HEIGHT = 174
"""Of the strip, in lengths of the layout."""
LEFT, RIGHT, TOP, ROW, GAP = 46.0, 470.0, 16.0, 38.0, 18.0
"""Edges of the charts, height of one, and room between two, in lengths of the layout."""
ARM, DEVICE, MUSCLES, EFFORT = (0, 114, 178), (213, 94, 0), (146, 66, 158), (33, 37, 43)
"""Colours of the curves, distinct for colour-blind readers."""
DASH, BLANK = 7, 5
"""Samples that a dashed curve shows, and that it leaves out, at 50 a second."""


class Line(NamedTuple):
    """A curve of a chart."""

    word: str
    colour: Colour
    of: Callable[[Scene], float]
    dashed: bool = False


class Chart(NamedTuple):
    """A quantity over time."""

    title: str
    lines: tuple[Line, ...]
    least: float
    """Span of the axis at least [unit of the quantity]."""


def _degrees(angle: float) -> float:
    return float(np.degrees(angle))


CHARTS = (
    Chart(
        "flexion [deg]",
        (
            Line("wanted", REFERENCE, lambda s: _degrees(s.reference_angle), dashed=True),
            Line("arm", ARM, lambda s: _degrees(s.elbow_angle)),
        ),
        20.0,
    ),
    Chart(
        "moment [Nm]",
        (Line("device", DEVICE, lambda s: s.device_moment), Line("muscles", MUSCLES, lambda s: s.muscle_moment)),
        2.0,
    ),
    Chart("effort [-]", (Line("of the patient", EFFORT, lambda s: s.effort),), 0.2),
)


class History:
    """Draws the strip of an episode.

    Args:
        size: width of the strip [pixel].
        scenes: of the episode.
        compared: of all episodes whose strips have the same axes, this one among them.
    """

    def __init__(self, size: int, scenes: Sequence[Scene], compared: Sequence[Sequence[Scene]]) -> None:
        self.canvas = Canvas(size, round(HEIGHT * size / 480))
        self._end = max(ones[-1].time for ones in compared) or 1.0
        self._values = [[np.array([line.of(s) for s in scenes]) for line in chart.lines] for chart in CHARTS]
        self._times = np.array([s.time for s in scenes])
        self._ranges = [_range(chart, compared) for chart in CHARTS]
        self._done = 0

    def draw(self, count: int) -> np.ndarray:
        """The strip after the first scenes, `count` of them: uint8, shape (height, size, 3).

        A longer strip adds to the last one, a shorter one begins anew.
        """
        canvas = self.canvas
        if count < self._done or self._done == 0:
            canvas.clear(PAPER)
            for k, (low, high) in enumerate(self._ranges):
                self._frame(k, low, high)
            self._done = 0
        # Moment by moment, so that the same curve lies above where curves cross, however the strip came about.
        for i in range(max(self._done - 1, 0), count - 1):
            self._moment(i)
        self._done = count
        canvas.smooth()
        for k, chart in enumerate(CHARTS):
            self._words(k, chart)
        return canvas.pixels()

    def _top(self, k: int) -> float:
        return TOP + k * (ROW + GAP)

    def _place(self, k: int, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Points of a chart in fine pixels, shape (n, 2)."""
        low, high = self._ranges[k]
        x = LEFT + (RIGHT - LEFT) * times / self._end
        y = self._top(k) + ROW * (high - values) / (high - low)
        return self.canvas.unit * np.column_stack([x, y])

    def _frame(self, k: int, low: float, high: float) -> None:
        """Edges of a chart, and its zero where it is inside."""
        ends = np.array([0.0, self._end])
        for value in (low, high, *([0.0] if low < 0.0 < high else [])):
            self.canvas.line(self._place(k, ends, np.full(2, value)), FRAME, 0.6)

    def _moment(self, i: int) -> None:
        """All curves from a scene to the next one."""
        for k, chart in enumerate(CHARTS):
            for line, values in zip(chart.lines, self._values[k], strict=True):
                if not line.dashed or i % (DASH + BLANK) < DASH:
                    self.canvas.line(self._place(k, self._times[i : i + 2], values[i : i + 2]), line.colour, 1.4)

    def _words(self, k: int, chart: Chart) -> None:
        """Title, names of the curves and ends of the axis."""
        y, (low, high) = self._top(k), self._ranges[k]
        self.canvas.words(chart.title, (LEFT, y - 12), INK, "small")
        x = RIGHT
        for line in reversed(chart.lines):
            self.canvas.words(line.word, (x, y - 12), line.colour, "small", "right")
            x -= 12.0 + 6.5 * len(line.word)
        decimals = 0 if high - low >= 10.0 else 1
        for value, at in ((high, y - 5), (low, y + ROW - 5)):
            self.canvas.words(fixed(value, decimals), (LEFT - 5, at), GREY, "small", "right")


def _range(chart: Chart, compared: Sequence[Sequence[Scene]]) -> tuple[float, float]:
    """Ends of an axis: what all curves of it span in all episodes, and at least `least`."""
    values = [line.of(s) for ones in compared for s in ones for line in chart.lines]
    low, high = min(values), max(values)
    missing = max(chart.least - (high - low), 0.0)
    return low - 0.5 * missing, high + 0.5 * missing

"""Pictures of the environment: arrays without a display, or a window.

pygame-ce is imported with the first `Renderer`, so that training without pictures needs no pygame.
"""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np

from dms_core.errors import DmsError, InputError
from exo_env.rendering.canvas import Canvas
from exo_env.rendering.picture import Picture
from exo_env.rendering.scales import Scales
from exo_env.rendering.scene import Scene

RenderMode = Literal["rgb_array", "human"]
SMALLEST = 120
"""Size below which the words cannot be read [pixel]."""
TITLE = "exo_env"


class Renderer:
    """Draws scenes.

    Args:
        mode: 'rgb_array' returns each picture; 'human' shows it in a window.
        fps: pictures per second of the window, which waits for its turn; an array never waits [1/s].
        size: height and width [pixel].
        scales: ends of the colours' scales.
    """

    def __init__(self, mode: RenderMode, fps: int, size: int = 480, scales: Scales | None = None) -> None:
        if mode not in get_args(RenderMode):
            raise InputError(f"render mode '{mode}' is unknown. Known: {', '.join(get_args(RenderMode))}.")
        if fps <= 0:
            raise InputError(f"fps = {fps}: expected a number above 0, of pictures per second.")
        if size < SMALLEST:
            raise InputError(f"size = {size}: expected at least {SMALLEST} pixels.")
        self.mode: RenderMode = mode
        self.fps, self.size = fps, size
        self._canvas = Canvas(size)
        self.scales = scales or Scales()
        self._picture = Picture(self._canvas, self.scales)
        self._window: Any = None
        self._clock: Any = None

    def draw(self, scene: Scene) -> np.ndarray | None:
        """The picture as uint8, shape (size, size, 3); None where it is shown in the window."""
        self._picture.draw(scene)
        if self.mode == "rgb_array":
            return self._canvas.pixels()
        self._show()
        return None

    def _show(self) -> None:
        """Put the picture into the window, which the first one opens, and wait until the next one is due."""
        pygame = self._canvas.pygame
        if self._window is None:
            self._open()
        self._window.blit(self._canvas.result, (0, 0))
        # Unread events would make the desktop believe that the program hangs.
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self.fps)

    def _open(self) -> None:
        pygame = self._canvas.pygame
        try:
            pygame.display.init()
            self._window = pygame.display.set_mode((self.size, self.size))
        except pygame.error as error:
            pygame.display.quit()
            message = f"no window can be opened ({error}); without a display use render_mode='rgb_array'."
            raise DmsError(message) from None
        pygame.display.set_caption(TITLE)
        self._clock = pygame.time.Clock()

    def close(self) -> None:
        """Close the window; a later `draw` opens it again."""
        if self._window is not None:
            self._canvas.pygame.display.quit()
            self._window = self._clock = None

    def __reduce__(self) -> tuple[type[Renderer], tuple[RenderMode, int, int, Scales]]:
        """Surfaces cannot be pickled; a copy draws the same on new ones."""
        return Renderer, (self.mode, self.fps, self.size, self.scales)

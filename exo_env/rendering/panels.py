"""What all figures of this project have in common: panels drawn by software (Agg), so that no display is needed."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from dms_core.errors import DmsError, both_ends, extra
from dms_core.files.output_file import write_bytes

P = ParamSpec("P")
R = TypeVar("R")
RESOLUTION = 150
"""Resolution of the figures [dots per inch]."""


def require_matplotlib() -> None:
    """Refuse a run whose figures could not be drawn, before it begins.

    Raises:
        DmsError: matplotlib is missing, or the user's settings of it are not usable.
    """
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise DmsError(f"figures need matplotlib. {extra('pictures')}") from None
    except ValueError as error:
        raise DmsError(
            f"matplotlib cannot be imported: {both_ends(str(error), 300)}. Look at the environment variable MPLBACKEND."
        ) from None


def drawn(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator: draw with matplotlib's own settings, whatever a user's matplotlibrc says."""

    @wraps(function)
    def draw(*args: P.args, **kwargs: P.kwargs) -> R:
        require_matplotlib()
        import matplotlib.style

        with matplotlib.style.context("default"):
            return function(*args, **kwargs)

    return draw


def panels(rows: int, columns: int, size: tuple[float, float], **shared: Any) -> tuple[Any, Any]:
    """A figure of a size [inch] with axes, shape (rows, columns); `shared`: of matplotlib's Figure.subplots."""
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=RESOLUTION, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False, **shared)
    for ax in axes.flat:
        ax.grid(True, color="0.9", linewidth=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    return figure, axes


def legend(figure: Any, ax: Any, columns: int) -> None:
    """Name the curves in `ax` above the panels, never on a curve."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=columns, frameon=False, fontsize=8)


def literal(text: str) -> str:
    """A text for a figure as it stands: in that of a user, $ begins no formula."""
    return text.replace("$", r"\$")


def save(figure: Any, path: Path) -> Path:
    """Write a picture as PNG, whole or not at all."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png")
    write_bytes(path, picture.getvalue())
    return path

"""What whoever draws with matplotlib needs: whether it is there, its own settings, and files that are written whole."""

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
FORMATS = (".png", ".svg", ".pdf")
"""Endings of pictures that can be written."""


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


def visible(figure: Any) -> list[Any]:
    """The panels of a figure that are shown, in the order of their letters."""
    return [ax for ax in figure.axes if ax.get_visible()]


def letter(figure: Any, ax: Any) -> str:
    """Letter of a panel, by which notes name it."""
    return chr(ord("a") + visible(figure).index(ax))


def put_letters(figure: Any) -> None:
    """Give the panels of a figure their letters, if there are several."""
    shown = visible(figure)
    for ax in shown if len(shown) > 1 else ():
        ax.annotate(
            letter(figure, ax), (0.0, 1.0), xytext=(-8.0, 5.0), xycoords="axes fraction", textcoords="offset points",
            ha="right", va="bottom", fontweight="bold", fontsize=11,
        )  # fmt: skip


def write_figure(figure: Any, path: Path) -> Path:
    """Write a picture whole or not at all, as its name ends."""
    picture = io.BytesIO()
    # Without the day, so that the same figure is the same file.
    metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix)
    figure.savefig(picture, format=path.suffix.removeprefix("."), metadata=metadata)
    write_bytes(path, picture.getvalue())
    return path

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


def write_figure(figure: Any, path: Path) -> Path:
    """Write a picture whole or not at all, as its name ends."""
    picture = io.BytesIO()
    # Without the day, so that the same figure is the same file.
    metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix)
    figure.savefig(picture, format=path.suffix.removeprefix("."), metadata=metadata)
    write_bytes(path, picture.getvalue())
    return path

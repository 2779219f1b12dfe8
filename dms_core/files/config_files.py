"""Where the shipped configuration lies: `configs/` of a checkout, `dms_core/configs` of an installed wheel."""

from __future__ import annotations

from pathlib import Path

import dms_core
from dms_core.errors import InputError, choices


def configs() -> Path:
    """Folder of the shipped configuration, whatever the working directory.

    Raises:
        InputError: it is nowhere; the installation is damaged.
    """
    package = Path(dms_core.__file__).resolve().parent
    places = (package / "configs", package.parent / "configs")
    for place in places:
        if place.is_dir():
            return place
    raise InputError(
        f"the configuration folder is missing: looked for {' and '.join(map(str, places))}. Reinstall exo-env."
    )


def config_file(name: str) -> Path:
    """A shipped file by its path inside `configs`, for example 'models/pendulum.yaml'.

    Raises:
        InputError: there is no such file; lists those of its folder.
    """
    path = configs() / name
    if not path.is_file():
        folder = path.parent
        found = sorted(p.name for p in folder.iterdir()) if folder.is_dir() else []
        raise InputError(f"configuration '{name}' does not exist. In '{folder}' there are: {choices(found)}.")
    return path

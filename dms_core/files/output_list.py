"""The list in an output folder of what a command wrote into it, by which the command knows its own files again."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

from dms_core.errors import InputError
from dms_core.files.json_text import checked, read_json
from dms_core.files.output_place import is_unfinished, renew
from dms_core.validation import Checked

MANIFEST = ".written.json"
"""Name of the list."""
LARGEST = 1 << 20
"""Size up to which a list is read [byte]."""
PARTIAL = re.compile(r".+\.partial\d*(\.[^.]*)?")
"""Names of files with a part of the results."""


class FileList(Checked):
    """What stands in a list."""

    command: str
    files: dict[str, str]
    """Hashes by name."""


def read_list(folder: Path) -> FileList | None:
    """The list of a folder; None where there is none that can be read."""
    try:
        return checked(FileList, read_json(folder / MANIFEST, LARGEST), MANIFEST)
    except InputError:
        return None


def write_list(folder: Path, command: str, files: Mapping[str, str]) -> None:
    """Write the list of a folder.

    Args:
        folder: that has the files.
        command: that wrote them.
        files: hashes by name.

    Raises:
        OSError: it cannot be written.
    """
    renew(folder / MANIFEST, json.dumps({"command": command, "files": dict(files)}, indent=2) + "\n")


def is_empty(folder: Path) -> bool:
    """Whether a folder holds nothing but parts of results, files that are not whole, and a list."""
    names = {path.name for path in folder.iterdir()}
    names = {name for name in names if not is_unfinished(name) and not PARTIAL.fullmatch(name)}
    return not names or (names == {MANIFEST} and read_list(folder) is not None)

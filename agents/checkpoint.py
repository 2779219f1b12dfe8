"""Folders that appear whole or not at all, the newest of them named by a pointer.

A checkpoint is written beside the others under a hidden name, with the hash of each file, and renamed when it is whole;
only then does `latest` name it. Whatever happens in between, `latest` names a whole one.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

from dms_core.errors import InputError
from dms_core.files.input_file import decoded, digest, read_bytes
from dms_core.files.json_text import brief, read_json
from dms_core.files.output_file import write_text

POINTER, HASHES = "latest", "hashes.json"
LONGEST_NAME, MOST_HASHES = 1 << 12, 1 << 20
"""Sizes up to which pointer and hashes are read [byte]."""


class Store:
    """Checkpoints of one kind.

    Args:
        folder: of the store; made with the first checkpoint.
        keep: how many remain.
    """

    def __init__(self, folder: Path, keep: int = 1) -> None:
        self.folder, self.keep = folder, keep

    def save(self, name: str, write: Callable[[Path], None]) -> Path:
        """A new checkpoint.

        Args:
            name: of its folder; later ones sort behind.
            write: fills a folder.

        Raises:
            OSError: the disk is full or cannot be written. What was there before is still there.
        """
        while (self.folder / name).exists():
            # A run that went on from an older checkpoint comes by this name again.
            name += "_again"
        part, path = self.folder / f".{name}.part", self.folder / name
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
        try:
            write(part)
            write_text(part / HASHES, json.dumps({f.name: digest(f) for f in sorted(part.iterdir())}, indent=2))
            for file in part.iterdir():
                _to_disk(file)
            part.rename(path)
        finally:
            shutil.rmtree(part, ignore_errors=True)
        write_text(self.folder / POINTER, f"{name}\n")
        _to_disk(self.folder)
        self._tidy(name)
        return path

    @property
    def empty(self) -> bool:
        """No checkpoint was ever whole."""
        return not (self.folder / POINTER).is_file()

    def latest(self) -> Path:
        """The newest checkpoint, its files as they were written.

        Raises:
            InputError: there is none, or a file is missing, cut off or changed; says what else there is.
        """
        if self.empty:
            raise InputError(f"'{self.folder}' is empty: the training has not reached its first checkpoint.")
        path = self.folder / self._pointed()
        try:
            hashes = read_hashes(path)
            bad = [name for name, known in hashes.items() if digest(path / name) != known]
        except InputError as error:
            raise InputError(f"checkpoint '{path}' is not whole: {error}{self._others(path)}") from None
        if bad:
            raise InputError(f"checkpoint '{path}': {bad[0]} is cut off or was changed.{self._others(path)}")
        return path

    def _pointed(self) -> str:
        """Name of the newest checkpoint."""
        pointer = self.folder / POINTER
        name = decoded(pointer, read_bytes(pointer, LONGEST_NAME)).strip()
        if not is_name(name):
            raise InputError(f"file '{pointer}' holds '{brief(name, 60)}': expected the name of a folder beside it.")
        return name

    def _others(self, path: Path) -> str:
        """Where to go on from instead."""
        older = sorted(
            p.name for p in self.folder.iterdir() if (p / HASHES).is_file() and p != path and p.name < path.name
        )
        return f" To go on from the one before, write {older[-1]} into '{self.folder / POINTER}'." if older else ""

    def _tidy(self, newest: str) -> None:
        """Remove what is not kept, and what a killed process left."""
        folders = sorted(p for p in self.folder.iterdir() if p.is_dir())
        whole = [p for p in folders if not p.name.startswith(".") and p.name <= newest]
        for path in folders:
            if path not in whole[-self.keep :]:
                shutil.rmtree(path, ignore_errors=True)


def read_hashes(checkpoint: Path) -> dict[str, str]:
    """Hashes of a checkpoint's files by their names.

    Raises:
        InputError: they are missing, or not whole.
    """
    path = checkpoint / HASHES
    hashes = read_json(path, MOST_HASHES)
    if not isinstance(hashes, dict) or not hashes or not all(isinstance(x, str) for x in hashes.values()):
        raise InputError(f"file '{path}': expected the hash of each file by its name.")
    for name in hashes:
        if not is_name(name):
            raise InputError(f"file '{path}': '{brief(name, 60)}' is not the name of a file beside it.")
    return hashes


def is_name(text: str) -> bool:
    """Whether a text is the name of something in a folder, and leads nowhere else."""
    return text.isprintable() and text not in ("", ".", "..") and not {"/", "\\"} & set(text)


def _to_disk(path: Path) -> None:
    """Out of the system's memory, so that a power failure leaves whole checkpoints too."""
    if os.name == "nt":
        return  # Windows cannot open folders, and keeps the order of renames by its journal.
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)

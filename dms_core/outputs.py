"""What a command writes: checked before its work, never lost when its place fails, and never an input of it.

A command says beforehand which files or which folder it will write. A file that it did not write before is replaced
only with --overwrite: a file is known by its first or last bytes, a folder by a list of the files written into it.
"""

from __future__ import annotations

import errno
import json
import os
import re
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

from dms_core.errors import DmsError, InputError, Stopped
from dms_core.input_file import digest
from dms_core.output_place import Content, cannot, check_folder, check_writable, descriptor, identity, is_file, put

MANIFEST = ".written.json"
"""List of a folder's files with their hashes."""
HEAD, TAIL = 1 << 20, 1 << 16
"""Bytes in which a file's mark is looked for, and bytes read at once."""
_active: list[Outputs] = []


class OutputFile(NamedTuple):
    """A file that a command writes."""

    option: str
    """By which the user names it."""
    path: Path
    mark: bytes
    """Regular expression, found in the beginning or end of files that the command wrote."""


class Outputs:
    """The outputs of a command; within its block all files are written through it.

    Args:
        command: its name.
        files: that it writes.
        folder: into which it writes files.
        inputs: files and folders that it reads; a str may as well be a name that is no file.
        overwrite: whether files of others may be replaced.

    Attributes:
        moved: folder that has what could not be written at its place, None where all could.
        written: files so far.

    Raises:
        InputError: a place cannot be written, is an input or another output, or holds files of others.
    """

    def __init__(
        self,
        command: str,
        *,
        files: Sequence[OutputFile] = (),
        folder: Path | None = None,
        inputs: Sequence[str | Path | None] = (),
        overwrite: bool = False,
    ) -> None:
        self.command, self.folder, self.overwrite = command, folder, overwrite
        self.moved: Path | None = None
        self.written: list[Path] = []
        self._inputs = [x for x in inputs if x is not None]
        self._known: dict[str, str] = {}
        self._new: dict[str, str] = {}
        self._check_files(files)
        if folder is not None:
            self._check_folder(folder)

    def __enter__(self) -> Outputs:
        _active.append(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _active.remove(self)
        if error is None and self.moved is None:
            self._remove_stale()
        if isinstance(error, KeyboardInterrupt) and not isinstance(error, Stopped):
            raise Stopped(self.so_far()) from None

    @property
    def failed(self) -> bool:
        """Whether a place could not be written, so that a command ends with another status than 0."""
        return self.moved is not None

    def where(self, path: Path) -> Path:
        """Where a file or the folder's files are now."""
        return path if self.moved is None or path in self.written else self.moved

    def so_far(self) -> str:
        """A sentence on what is written."""
        if not self.written:
            return "nothing was written."
        return f"written before: {', '.join(repr(str(path)) for path in self.written)}; the rest is missing."

    def write(self, path: Path, content: Content) -> None:
        """Write a file at its place, or, from the first place that fails, into a new folder for temporary files.

        Raises:
            DmsError: it cannot be written there either.
        """
        if self.moved is None:
            try:
                self._put(path, content)
                return
            except OSError as error:
                if isinstance(error, BrokenPipeError) and descriptor(path) is not None:
                    raise  # The reader of standard output has seen enough.
                reason = cannot(path, error)
            self.moved = _new_folder(reason)
            print(f"error: {reason} What is done is kept in '{self.moved}'.", file=sys.stderr)
        name = path.name
        while (self.moved / name).exists():
            name = f"_{name}"
        try:
            put(self.moved / name, content)
        except OSError as error:
            if not any(self.moved.iterdir()):
                self.moved.rmdir()
            raise DmsError(cannot(self.moved / name, error)) from None

    def _put(self, path: Path, content: Content) -> None:
        """Write a file at its place and list it."""
        inside = self.folder is not None and path.parent == self.folder
        if inside and path.name not in (*self._known, *self._new) and is_file(path) and not self.overwrite:
            raise FileExistsError(errno.EEXIST, f"it exists and was not written by `{self.command}`", str(path))
        if is_file(path) and self._input_at(path) is not None:
            raise FileExistsError(errno.EEXIST, "it is an input", str(path))
        put(path, content)
        self.written.append(path)
        if inside and is_file(path):
            self._new[path.name] = digest(path)
            self._list()

    def _list(self) -> None:
        """Write the list of files now, so that a command that is killed leaves a folder that it can renew."""
        assert self.folder is not None
        text = json.dumps({"command": self.command, "files": self._known | self._new}, indent=2) + "\n"
        put(self.folder / MANIFEST, lambda file: file.write(text.encode()))

    def _remove_stale(self) -> None:
        """Remove what an earlier run of the command wrote and this one did not: it would be of other results."""
        stale = [name for name in self._known if name not in self._new]
        if self.folder is None or not stale or not self._new:
            return
        for name in stale:
            (self.folder / name).unlink(missing_ok=True)
        self._known = {}
        self._list()

    def _check_files(self, files: Sequence[OutputFile]) -> None:
        """Refuse files that cannot be written or must not be replaced."""
        for option, path, _ in files:
            check_writable(path)
            if (same := self._input_at(path)) is not None:
                raise InputError(f"{option} '{path}' is the input '{same}'; choose another place.")
        known = [(identity(f.path), f) for f in files if is_file(f.path) or not f.path.exists()]
        for k, (one, first) in enumerate(known):
            for other, second in known[:k]:
                if one == other:
                    raise InputError(f"{second.option} and {first.option} are the same file '{first.path}'.")
        for option, path, mark in files:
            if is_file(path) and not self.overwrite and not re.search(mark, _ends(path)):
                raise InputError(
                    f"{option} '{path}' exists and was not written by `{self.command}`; choose another name, or give "
                    "--overwrite to replace it."
                )

    def _check_folder(self, folder: Path) -> None:
        """Refuse a folder that cannot be written or that holds what must not be replaced."""
        check_folder(folder)
        if not any(path.name != MANIFEST for path in folder.iterdir()):
            return
        known = _listed(folder, self.command)
        for path in (folder, *(folder / name for name in known or ())):
            if (same := self._input_at(path)) is not None:
                raise InputError(f"output '{path}' is the input '{same}'; choose another --out.")
        if self.overwrite:
            self._known = {n: h for n, h in (known or {}).items() if _hash(folder / n) == h}
            return
        if known is None:
            raise InputError(
                f"output folder '{folder}' is not empty and was not written by `{self.command}`; choose another --out, "
                "or give --overwrite to replace files of the same names in it."
            )
        for name, hashed in known.items():
            if _hash(folder / name) not in (hashed, None):
                raise InputError(
                    f"output '{folder / name}' was changed since `{self.command}` wrote it; choose another --out, or "
                    "give --overwrite to replace it."
                )
        self._known = known

    def _input_at(self, path: Path) -> Path | None:
        """The input that a path names, if it does."""
        if not path.exists():
            return None
        wanted = identity(path)
        return next((one for one in self._all_inputs() if identity(one) == wanted), None)

    def _all_inputs(self) -> Iterator[Path]:
        """Inputs that exist, and the files of those that are folders."""
        for one in self._inputs:
            if is_input_file(one):
                yield Path(one)
            elif isinstance(one, Path) and one.is_dir():
                yield one
                yield from (Path(root) / name for root, _, names in os.walk(one) for name in names)


def is_input_file(name: str | Path) -> bool:
    """Whether a name is that of a file; a text that cannot be one is none."""
    try:
        return os.path.isfile(name)
    except (OSError, ValueError):
        return False


def active_outputs() -> Outputs | None:
    """Those of the command that runs; None outside a command."""
    return _active[-1] if _active else None


def partial(path: Path) -> Path:
    """A new name for a part of the results, run.partial.csv for run.csv; pipes and devices take the part themselves."""
    if path.exists() and not path.is_file():
        return path
    count, part = 1, path.with_name(f"{path.stem}.partial{path.suffix}")
    while part.exists():
        count += 1
        part = path.with_name(f"{path.stem}.partial{count}{path.suffix}")
    return part


def _hash(path: Path) -> str | None:
    """Hash of a file; None where there is none."""
    return digest(path) if path.is_file() else None


def _listed(folder: Path, command: str) -> dict[str, str] | None:
    """Files that a command wrote into a folder, with their hashes; None where it was another or nobody knows."""
    try:
        content = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        if content["command"] != command:
            return None
        # A name with a folder in it would reach outside.
        return {str(k): str(v) for k, v in content["files"].items() if Path(k).name == k}
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _ends(path: Path) -> bytes:
    """Beginning and end of a file."""
    with path.open("rb") as file:
        head = file.read(HEAD)
        file.seek(max(file.seek(0, os.SEEK_END) - TAIL, len(head)))
        return head + file.read()


def _new_folder(reason: str) -> Path:
    """A folder for what has no place.

    Raises:
        DmsError: there is none.
    """
    try:
        return Path(tempfile.mkdtemp(prefix="exo_env_"))
    except OSError as error:
        raise DmsError(f"{reason} Nor is there a place for temporary files ({error.strerror}).") from None

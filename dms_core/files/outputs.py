"""What a command writes: checked before its work, never lost when its place fails, and never an input of it.

A command says beforehand which files or which folder it will write. A file that is there is replaced only with
--overwrite, whatever it holds. A folder is renewed by the command that wrote it: a list in it has its files with their
hashes, by which a file of others, or one that was changed since, is known. That is looked at before the work and once
more when a file takes its place.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, NamedTuple

from dms_core.errors import DmsError, InputError, Stopped
from dms_core.files.input_file import digest
from dms_core.files.output_list import MANIFEST, is_empty, read_list, write_list
from dms_core.files.output_place import (
    Content,
    PlaceError,
    cannot,
    check_folder,
    check_kind,
    check_writable,
    descriptor,
    identity,
    is_file,
    put,
    remove_unfinished,
    unfinished,
)

LONGEST_NAME = 240
"""Longest name to which '.partial' is added [byte]; of a longer one the end is left out, since systems take 255."""
_active: list[Outputs] = []


class OutputFile(NamedTuple):
    """A file that a command writes."""

    option: str
    """By which the user names it."""
    path: Path


class Outputs:
    """The outputs of a command; within its block all files are written through it.

    Args:
        command: its name.
        files: that it writes.
        folder: into which it writes files.
        inputs: files and folders that it reads; a str may as well be a name that is no file.
        overwrite: whether files that are there, and are not known to be its own, may be replaced.

    Attributes:
        moved: folder that has what could not be written at its place, None where all could.
        written: files so far.
        parts: files for a part of the results; they are not listed, so that no later run removes them.

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
        self.parts: set[Path] = set()
        self._inputs = [x for x in inputs if x is not None]
        self._own: dict[Path, str] = {}
        """Files of the command, from this run or from the folder's list, with their hashes."""
        self._check_files(files)
        if folder is not None:
            self._check_folder(folder)
        self._stale = set(self._own)
        self._unfinished: dict[Path, int] = {}
        for place in {Path(os.path.realpath(f.path)).parent for f in files} | ({folder} if folder else set()):
            self._unfinished |= unfinished(place)

    def __enter__(self) -> Outputs:
        _active.append(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _active.remove(self)
        if error is None and self.moved is None:
            self._remove_stale()
            remove_unfinished(self._unfinished)
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
            except PlaceError as error:
                reason = str(error)
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

        def checked_content(file: IO[bytes]) -> None:
            content(file)
            # To write may take long.
            self._check_place(path)

        self._check_place(path)
        put(path, checked_content)
        self.written.append(path)
        if is_file(path) and path not in self.parts:
            self._own[path] = digest(path)
            self._stale.discard(path)
            self._list()

    def _check_place(self, path: Path) -> None:
        """Refuse a place that has got a file of others, or an input, since the command began.

        Raises:
            PlaceError: names it.
        """
        check_kind(path)
        if path.parent == self.folder and os.path.exists(path) and not path.is_file():
            raise PlaceError(f"output '{path}' is no regular file; remove it, or choose another --out.")
        if not is_file(path):
            return
        if (same := self._input_at(path)) is not None:
            raise PlaceError(f"output '{path}' is the input '{same}'.")
        if self.overwrite or self._is_own(path):
            return
        what = "was changed since" if path in self._own else "exists and was not written by"
        raise PlaceError(f"output '{path}' {what} `{self.command}`{' wrote it' if path in self._own else ''}.")

    def _is_own(self, path: Path) -> bool:
        """Whether a file is as the command wrote it."""
        try:
            return path in self._own and path.is_file() and digest(path) == self._own[path]
        except InputError:
            return False

    def _list(self) -> None:
        """Write the list of files now, so that a command that is killed leaves a folder that it can renew."""
        if self.folder is None:
            return
        files = {path.name: hashed for path, hashed in self._own.items() if path.parent == self.folder}
        write_list(self.folder, self.command, files)

    def _remove_stale(self) -> None:
        """Remove what an earlier run of the command wrote and this one did not: it would be of other results."""
        if not self._stale or not self.written:
            return
        for path in self._stale:
            if self._is_own(path):
                path.unlink(missing_ok=True)
            del self._own[path]
        self._list()

    def _check_files(self, files: Sequence[OutputFile]) -> None:
        """Refuse files that cannot be written or must not be replaced."""
        for option, path in files:
            if (same := self._input_at(path)) is not None:
                raise InputError(f"{option} '{path}' is the input '{same}'; choose another place.")
        known = [(identity(f.path), f) for f in files if is_file(f.path) or not os.path.exists(f.path)]
        for k, (one, first) in enumerate(known):
            for other, second in known[:k]:
                if one == other:
                    raise InputError(f"{second.option} and {first.option} are the same file '{first.path}'.")
        for option, path in files:
            check_writable(path)
            if is_file(path) and not self.overwrite:
                raise InputError(f"{option} '{path}' exists; choose another name, or give --overwrite to replace it.")

    def _check_folder(self, folder: Path) -> None:
        """Refuse a folder that cannot be written or that holds what must not be replaced."""
        check_folder(folder)
        check_kind(folder / MANIFEST)
        listed = read_list(folder)
        if listed is not None and listed.command == self.command:
            # By what is there, since a name in the list may reach outside or be none.
            names = listed.files.keys() - {MANIFEST}
            self._own = {path: listed.files[path.name] for path in folder.iterdir() if path.name in names}
        if not self._own and is_empty(folder):
            return
        for path in (folder, *self._own):
            if (same := self._input_at(path)) is not None:
                raise InputError(f"output '{path}' is the input '{same}'; choose another --out.")
        for path in self._own:
            check_kind(path)
        if self.overwrite:
            self._own = {path: hashed for path, hashed in self._own.items() if self._is_own(path)}
            return
        if listed is None or listed.command != self.command:
            raise InputError(
                f"output folder '{folder}' is not empty and was not written by `{self.command}`; choose another --out, "
                "or give --overwrite to replace files of the same names in it."
            )
        for path in self._own:
            if not self._is_own(path):
                raise InputError(
                    f"output '{path}' was changed since `{self.command}` wrote it; choose another --out, or "
                    "give --overwrite to replace it."
                )

    def _input_at(self, path: Path) -> Path | None:
        """The input that a path names, if it does."""
        if not os.path.exists(path):
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
    stem = path.stem
    while len(stem) > 1 and len(os.fsencode(stem + path.suffix)) > LONGEST_NAME:
        stem = stem[:-1]
    count, part = 1, path.with_name(f"{stem}.partial{path.suffix}")
    while os.path.exists(part):
        count += 1
        part = path.with_name(f"{stem}.partial{count}{path.suffix}")
    if (outputs := active_outputs()) is not None:
        outputs.parts.add(part)
    return part


def _new_folder(reason: str) -> Path:
    """A folder for what has no place.

    Raises:
        DmsError: there is none.
    """
    try:
        return Path(tempfile.mkdtemp(prefix="exo_env_"))
    except OSError as error:
        raise DmsError(f"{reason} Nor is there a place for temporary files ({error.strerror}).") from None

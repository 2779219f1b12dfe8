"""Where a file may be written, and how it takes its place whole or not at all.

Symbolic links are followed: the link stays, what it names is replaced. Pipes and devices are written through; sockets
and disks are refused, and so is a file of several names (hard links), of which only one would be renewed. A file that
is replaced keeps its permission bits and, where the system allows it, its owner.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import stat
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO

from dms_core.errors import InputError, both_ends

PREFIX, SUFFIX = ".exo-", ".part"
"""Name of a file that is not whole yet; short whatever the name of the output is."""
REMEDIES = {
    errno.ENOSPC: "free some space there or choose another place",
    errno.EDQUOT: "free some of your quota there or choose another place",
    errno.EFBIG: "the system's limit on the size of a file is smaller (ulimit -f); choose another place or write less",
    errno.ENAMETOOLONG: "choose a shorter name",
}
"""What to do about an error by its number; another place is always right."""
PROBE = 4096
"""Written to see whether there is room at all [byte]."""
LONGEST_PATH = 200
"""Characters of a path in a message; of a longer one both ends are shown."""
MOST_LINKS = 40
"""Symbolic links that Linux follows, one after another."""
Content = Callable[[IO[bytes]], object]
"""Writes into an open file."""


class PlaceError(InputError):
    """A place where nothing must be written; what was to stand there may be written elsewhere."""


def check_writable(path: str | Path) -> Path:
    """The path, if a file can be written there; missing folders are made. Call it before a long run.

    Raises:
        InputError: names the place and the reason.
    """
    path = check_kind(path)
    mode = _mode(path)
    if descriptor(path) is None and (mode is None or stat.S_ISREG(mode)):
        _check_parent(path, Path(os.path.realpath(path)))
    return path


def check_kind(path: str | Path) -> Path:
    """The path, if what is there may be replaced or written through.

    Raises:
        PlaceError: it is a folder, a socket, a disk, read-only, or a file of several names.
        InputError: nothing could be there.
    """
    path = Path(path)
    mode = _mode(path)
    if mode is not None and stat.S_ISDIR(mode):
        raise PlaceError(f"output '{path}' is a folder; give the name of a file in it.")
    if mode is None or _through(mode) or descriptor(path) is not None:
        return path
    if not stat.S_ISREG(mode):
        raise PlaceError(
            f"output '{path}' is a socket or a disk: expected a file, a pipe or a device such as /dev/null."
        )
    if not (mode & 0o222 and os.access(path, os.W_OK)):
        raise PlaceError(
            f"output '{path}' is read-only (mode {mode & 0o777:03o}); allow writing or choose another place."
        )
    if (names := os.stat(path).st_nlink) > 1:
        raise PlaceError(
            f"output '{path}' is a file of {names} names (hard links), of which only this one would be renewed; choose "
            "another place, or remove this name first."
        )
    return path


def check_folder(folder: str | Path) -> Path:
    """The path, if files can be written into a folder of that name; it is made where it is missing.

    Raises:
        InputError: names the place and the reason.
    """
    folder = Path(folder)
    mode = _mode(folder)
    if mode is not None and not stat.S_ISDIR(mode):
        raise InputError(f"output '{folder}': '{folder}' is a file, not a folder; choose another place.")
    _check_parent(folder, Path(os.path.realpath(folder)) / "x")
    return folder


def put(path: Path, content: Content) -> None:
    """Write a file whole or not at all; a pipe or a device is written through.

    Raises:
        OSError: the disk is full or cannot be written; what was there before is still there.
    """
    try:
        number, mode = descriptor(path), _mode(path)
        if number is not None:
            sys.stdout.flush()
            with os.fdopen(os.dup(number), "wb") as file:
                content(file)
        elif mode is not None and _through(mode):
            with open(path, "wb") as file:
                content(file)
        else:
            target = Path(os.path.realpath(path))
            target.parent.mkdir(parents=True, exist_ok=True)
            _replace(target, content)
    except OSError as error:
        # The error may name our temporary file, or none.
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


def renew(path: Path, text: str) -> None:
    """Write a file that is ours alone: what else has its name, such as a link or a pipe, gives way to it.

    Raises:
        OSError: the disk is full or cannot be written, or a folder has the name.
    """
    try:
        _replace(path, lambda file: file.write(text.encode()))
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


def is_unfinished(name: str) -> bool:
    """Whether it is the name of a file that is not whole yet, or whose writer was killed."""
    return name.startswith(PREFIX) and name.endswith(SUFFIX)


def unfinished(folder: Path) -> dict[Path, int]:
    """Files of a folder that are not whole, each with the time of its last change, which moves while one is written."""
    with contextlib.suppress(OSError):
        return {path: path.lstat().st_mtime_ns for path in folder.iterdir() if is_unfinished(path.name)}
    return {}


def remove_unfinished(before: Mapping[Path, int]) -> None:
    """Remove files that are still as `unfinished` found them: their writer is gone."""
    for path, changed in before.items():
        with contextlib.suppress(OSError):
            if path.lstat().st_mtime_ns == changed:
                path.unlink()


def identity(path: str | Path) -> tuple[object, ...]:
    """What is equal for two names of the same file: hard links and symbolic ones too."""
    try:
        known = os.stat(path)
    except (OSError, ValueError):
        return (os.path.realpath(path),) if "\0" not in str(path) else ()
    return known.st_dev, known.st_ino


def is_file(path: str | Path) -> bool:
    """Whether there is a regular file with something in it, which could be lost."""
    mode = _mode(Path(path))
    return mode is not None and stat.S_ISREG(mode) and descriptor(Path(path)) is None and os.path.getsize(path) > 0


def cannot(path: str | Path, error: OSError) -> str:
    """One sentence on an error of writing, with the place and what to do."""
    return f"output '{_shown(path)}' cannot be written ({error.strerror or error}); {remedy(error)}."


def remedy(error: OSError) -> str:
    """What to do about an error of writing."""
    return REMEDIES.get(error.errno or 0, "choose another place")


def descriptor(path: Path) -> int | None:
    """Number of an open file of this process that a path names, as /dev/stdout or /dev/fd/3 do; None for others."""
    at, own = os.path.abspath(path), ("/dev/fd", f"/proc/{os.getpid()}/fd")
    for _ in range(MOST_LINKS):
        folder, name = os.path.split(at)
        if name.isdecimal() and os.path.realpath(folder) in own:
            return int(name)
        if not os.path.islink(at):
            return None
        at = os.path.normpath(os.path.join(folder, os.readlink(at)))
    return None


def _replace(target: Path, content: Content) -> None:
    """Write beside a file, then take its name."""
    # What replaces a private file is private from its first byte.
    handle, temporary = _create(target.parent, 0o600 if target.exists() else 0o666)
    try:
        with os.fdopen(handle, "wb") as file:
            content(file)
            file.flush()
            # A network drive says only here that it is full.
            os.fsync(file.fileno())
        _take_permissions(temporary, target)
        os.replace(temporary, target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _create(folder: Path, mode: int) -> tuple[int, Path]:
    """A new file that is not whole yet: its descriptor and name.

    Args:
        folder: of the file.
        mode: permission bits, of which the system takes those of the umask away.
    """
    flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_BINARY", 0)
    while True:
        path = folder / f"{PREFIX}{secrets.token_hex(6)}{SUFFIX}"
        with contextlib.suppress(FileExistsError):
            return os.open(path, flags, mode), path


def _take_permissions(temporary: Path, target: Path) -> None:
    """Owner and permission bits of the file that is replaced; a new one has those that the system gave it."""
    try:
        known = os.stat(target)
    except FileNotFoundError:
        return
    if hasattr(os, "chown"):
        with contextlib.suppress(PermissionError):
            os.chown(temporary, known.st_uid, known.st_gid)
    os.chmod(temporary, stat.S_IMODE(known.st_mode))


def _mode(path: Path) -> int | None:
    """Kind and permissions of what is there, links followed; None where there is nothing.

    Raises:
        InputError: nothing could be there.
    """
    try:
        return os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise InputError(cannot(path, error)) from None
    except ValueError:
        raise InputError(f"output {str(path)!r}: expected a name without the character NUL.") from None


def _through(mode: int) -> bool:
    """Whether it is written through: a pipe, or a device that takes characters."""
    return stat.S_ISFIFO(mode) or stat.S_ISCHR(mode)


def _check_parent(path: Path, target: Path) -> None:
    """Refuse a file whose folder cannot be made or written.

    Args:
        path: as the user gave it.
        target: where the file will be.
    """
    folder = target.parent
    there = folder
    while not there.exists() and there != there.parent:
        there = there.parent
    if not there.is_dir():
        raise InputError(f"output '{path}': '{there}' is a file, not a folder; choose another place.")
    try:
        longest = os.pathconf(there, "PC_NAME_MAX") if hasattr(os, "pathconf") else 255
        for name in target.parts[len(there.parts) :]:
            if (count := len(os.fsencode(name))) > longest:
                raise InputError(
                    f"output '{_shown(path)}': a name in it has {count} bytes; choose one of at most {longest}."
                )
        folder.mkdir(parents=True, exist_ok=True)
        # Permission bits tell root nothing and network drives lie; only writing shows that writing works.
        handle, temporary = _create(folder, 0o600)
        try:
            # A full disk still makes empty files.
            os.write(handle, bytes(PROBE))
        finally:
            os.close(handle)
            os.unlink(temporary)
    except OSError as error:
        reason = f"the folder '{_shown(folder)}' cannot be written ({error.strerror}); {remedy(error)}"
        raise InputError(f"output '{_shown(path)}': {reason}.") from None


def _shown(path: str | Path) -> str:
    """A path for a message."""
    return both_ends(str(path), LONGEST_PATH)

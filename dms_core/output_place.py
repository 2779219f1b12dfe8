"""Where a file may be written, and how it takes its place whole or not at all.

Symbolic links are followed: the link stays, what it names is replaced. Pipes and devices are written through; sockets
and disks are refused. A file that is replaced keeps its permission bits and, where the system allows it, its owner.
"""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO

from dms_core.errors import InputError

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
MOST_LINKS = 40
"""Symbolic links that Linux follows, one after another."""
Content = Callable[[IO[bytes]], object]
"""Writes into an open file."""


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
        InputError: it is a folder, a socket, a disk, or read-only.
    """
    path = Path(path)
    mode = _mode(path)
    if mode is not None and stat.S_ISDIR(mode):
        raise InputError(f"output '{path}' is a folder; give the name of a file in it.")
    if mode is None or _through(mode) or descriptor(path) is not None:
        return path
    if not stat.S_ISREG(mode):
        raise InputError(
            f"output '{path}' is a socket or a disk: expected a file, a pipe or a device such as /dev/null."
        )
    if not (mode & 0o222 and os.access(path, os.W_OK)):
        raise InputError(
            f"output '{path}' is read-only (mode {mode & 0o777:03o}); allow writing or choose another place."
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
    return f"output '{_short(Path(path))}' cannot be written ({error.strerror or error}); {remedy(error)}."


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
    handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=PREFIX, suffix=SUFFIX)
    try:
        with os.fdopen(handle, "wb") as file:
            content(file)
            file.flush()
            # A network drive says only here that it is full.
            os.fsync(file.fileno())
        _take_permissions(temporary, target)
        os.replace(temporary, target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _take_permissions(temporary: str, target: Path) -> None:
    """Owner and permission bits of the file that is replaced, or those of a new one."""
    try:
        known = os.stat(target)
    except FileNotFoundError:
        os.chmod(temporary, 0o666 & ~_umask())
        return
    if hasattr(os, "chown"):
        with contextlib.suppress(PermissionError):
            os.chown(temporary, known.st_uid, known.st_gid)
    os.chmod(temporary, stat.S_IMODE(known.st_mode))


def _umask() -> int:
    """Permission bits that new files do not get; it can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


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
                    f"output '{_short(path)}': a name in it has {count} bytes; choose one of at most {longest}."
                )
        folder.mkdir(parents=True, exist_ok=True)
        # Permission bits tell root nothing and network drives lie; only writing shows that writing works.
        handle, temporary = tempfile.mkstemp(dir=folder, prefix=PREFIX, suffix=SUFFIX)
        try:
            # A full disk still makes empty files.
            os.write(handle, bytes(PROBE))
        finally:
            os.close(handle)
            os.unlink(temporary)
    except OSError as error:
        reason = f"the folder '{_short(folder)}' cannot be written ({error.strerror}); {remedy(error)}"
        raise InputError(f"output '{_short(path)}': {reason}.") from None


def _short(path: Path) -> str:
    """A path for a message, the middle of a very long one left out."""
    text = str(path)
    return text if len(text) <= 200 else f"{text[:90]} ... {text[-90:]}"

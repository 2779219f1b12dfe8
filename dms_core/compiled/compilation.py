"""Machine code on disk: kept while the sources are the same, dropped when they change, announced when it is missing.

numba keeps compiled functions beside their source and compiles one anew when its own file changes, but not when a
function that it calls from another file does. After an update of some files, machine code of the old version would run
in silence; so all of it is dropped whenever any compiled source of the package has changed.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
import sys
import time
from pathlib import Path
from typing import Any, TextIO

from numba.core import event
from numba.core.caching import NullCache

PACKAGE = Path(__file__).parents[1]
STAMP = "compiled_sources.sha256"
QUIET = 1.0
"""Pause after which more compiling is announced again [s]."""
INTERVAL = 10.0
"""Time between two lines about the progress where there is no terminal whose line could be rewritten [s]."""
WIDTH = 79
"""Characters of the line on a terminal."""
CALLED = "_called"
"""End of the name under which a function is compiled for callers that are compiled themselves."""
SHAPING = (b"@compiled", b"NamedTuple", b"places(", b"trait(")
"""What a source holds that shapes compiled code: functions, or the places of what they read."""
LAYOUT = ("assembly", "compiled")
"""Folders all of whose sources count, whether they hold such a thing or not."""


def fingerprint(package: Path = PACKAGE) -> str:
    """Hash of every source file that shapes compiled functions, of this package and of one built on it."""
    digest = hashlib.sha256()
    for folder in dict.fromkeys((PACKAGE, package)):
        for path in sorted(folder.rglob("*.py")):
            text, place = path.read_bytes(), path.relative_to(folder)
            if any(mark in text for mark in SHAPING) or place.parts[0] in LAYOUT:
                digest.update(place.as_posix().encode() + b"\0" + text)
    return digest.hexdigest()


def drop_stale_code(package: Path = PACKAGE) -> None:
    """Remove numba's files of a package if they belong to other sources. Without write access nothing is done."""
    now, stamp = fingerprint(package), package / "__pycache__" / STAMP
    with contextlib.suppress(OSError):
        if stamp.is_file() and stamp.read_text() == now:
            return
        for pattern in ("*.nbi", "*.nbc"):
            for path in package.rglob(f"__pycache__/{pattern}"):
                path.unlink(missing_ok=True)
        stamp.parent.mkdir(exist_ok=True)
        stamp.write_text(now)


_functions = 0
"""Functions that this process may have to compile, as far as it has imported them."""


def count_function() -> None:
    """One more function that may have to be compiled."""
    global _functions
    _functions += 1


class _Announcer(event.Listener):
    """Shows on stderr what is being compiled and how far it is: numba tells, so nothing is said from a warm cache.

    On a terminal one line is rewritten; elsewhere there is a line at the beginning and one every ten seconds. A first
    reset compiles, and so does the first step behind it: what comes after a while is announced again.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._given = stream
        self._depth, self._ended, self._done = 0, -math.inf, 0
        self._began = self._spoke = 0.0

    @property
    def _stream(self) -> TextIO:
        """Where words go: to what stderr is now, since who has redirected it may have closed what it was."""
        return self._given or sys.stderr

    def on_start(self, event: event.Event) -> None:
        """A function begins to be compiled; those that are not kept on disk are small and not worth a word."""
        if not _kept(event):
            return
        self._depth += 1
        now = time.monotonic()
        if self._depth == 1 and now - self._ended > QUIET:
            self._began, self._spoke = now, now
            self._say("compiling what is new, kept on disk (seconds; about a minute the very first time) ...")
        self._show(event.data["dispatcher"].py_func, now)

    def on_end(self, event: event.Event) -> None:
        """The pause between two stretches of compiling begins where the outermost function is done."""
        if not _kept(event):
            return
        self._depth -= 1
        self._done += 1
        if self._depth == 0:
            self._ended = time.monotonic()
            if self._stream.isatty():
                self._stream.write("\r" + " " * WIDTH + "\r")
                self._stream.flush()

    def wait(self) -> None:
        """Nothing is compiled here until a second process has done its share."""
        if self._stream.isatty():
            self._stream.write("\rdms_core: waiting for code that a second process compiles".ljust(WIDTH))
            self._stream.flush()

    def _say(self, text: str) -> None:
        print(f"dms_core: {text}", file=self._stream, flush=True)

    def _show(self, function: Any, now: float) -> None:
        """The function at work, and how many are done."""
        # Inner functions of numba's own are compiled on the way.
        name = f"{function.__module__.rpartition('.')[2]}.{function.__name__.removesuffix(CALLED)}"
        total = max(_functions, self._done + 1)
        text = f"{self._done} of at most {total} functions, {now - self._began:.0f} s: {name}"
        if self._stream.isatty():
            self._stream.write(f"\rdms_core: {text}"[:WIDTH].ljust(WIDTH))
            self._stream.flush()
        elif now - self._spoke > INTERVAL:
            self._spoke = now
            self._say(text)


def _kept(event: event.Event) -> bool:
    """Whether what is compiled is kept on disk."""
    return not isinstance(event.data["dispatcher"]._cache, NullCache)


_announcer: _Announcer | None = None


def announce_waiting() -> None:
    """Say that this process waits for code which a second one compiles."""
    if _announcer is not None:
        _announcer.wait()


def announce() -> None:
    """From now on, show on stderr what has to be compiled."""
    global _announcer
    if _announcer is None:
        _announcer = _Announcer()
        event.register("numba:compile", _announcer)

"""Compiling is announced when it happens: what is compiled, and how far it is."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from typing import Any, TextIO

from numba.core import event
from numba.core.caching import NullCache

QUIET = 1.0
"""Pause after which more compiling is announced again [s]."""
INTERVAL = 10.0
"""Time between two lines about the progress where there is no terminal whose line could be rewritten [s]."""
WIDTH = 79
"""Characters of the line on a terminal."""
CALLED = "_called"
"""End of the name under which a function is compiled for callers that are compiled themselves."""


def write(text: str, stream: TextIO | None = None) -> None:
    """Write to a stream, or to stderr; where that is closed, gone or full, nobody reads it and nothing fails."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        to = stream or sys.stderr
        to.write(text)
        to.flush()


def _is_terminal(stream: TextIO | None) -> bool:
    with contextlib.suppress(ValueError):
        return stream is not None and stream.isatty()
    return False


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

    def _write(self, text: str) -> None:
        """Words go to what stderr is now, since who has redirected it may have closed what it was."""
        write(text, self._given)

    @property
    def _on_terminal(self) -> bool:
        return _is_terminal(self._given or sys.stderr)

    def on_start(self, event: event.Event) -> None:
        """A function begins to be compiled; those that are not kept on disk are small and not worth a word."""
        if not _kept(event):
            return
        self._depth += 1
        now = time.monotonic()
        if self._depth == 1 and now - self._ended > QUIET:
            self._began, self._spoke = now, now
            self._say("compiling what is new (seconds; about a minute the very first time) ...")
        self._show(event.data["dispatcher"].py_func, now)

    def on_end(self, event: event.Event) -> None:
        """The pause between two stretches of compiling begins where the outermost function is done."""
        if not _kept(event):
            return
        self._depth -= 1
        self._done += 1
        if self._depth == 0:
            self._ended = time.monotonic()
            if self._on_terminal:
                self._write("\r" + " " * WIDTH + "\r")

    def wait(self) -> None:
        """Nothing is compiled here until a second process has done its share."""
        if self._on_terminal:
            self._write("\rdms_core: waiting for code that a second process compiles".ljust(WIDTH))

    def _say(self, text: str) -> None:
        self._write(f"dms_core: {text}\n")

    def _show(self, function: Any, now: float) -> None:
        """The function at work, and how many are done."""
        # Inner functions of numba's own are compiled on the way.
        name = f"{function.__module__.rpartition('.')[2]}.{function.__name__.removesuffix(CALLED)}"
        total = max(_functions, self._done + 1)
        text = f"{self._done} of at most {total} functions, {now - self._began:.0f} s: {name}"
        if self._on_terminal:
            self._write(f"\rdms_core: {text}"[:WIDTH].ljust(WIDTH))
        elif now - self._spoke > INTERVAL:
            self._spoke = now
            self._say(text)


def _kept(event: event.Event) -> bool:
    """Whether what is compiled is to be kept on disk."""
    return type(event.data["dispatcher"]._cache) is not NullCache


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

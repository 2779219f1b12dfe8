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

from numba.core import event
from numba.core.caching import NullCache

PACKAGE = Path(__file__).parents[1]
STAMP = "compiled_sources.sha256"
QUIET = 1.0
"""Pause after which more compiling is told of again [s]."""


LAYOUT = ("assembly", "compiled")
"""Sources that say where compiled code finds its arrays, whether they hold compiled functions or not."""


def fingerprint(package: Path = PACKAGE) -> str:
    """Hash of every source file that shapes compiled functions, of this package and of one built on it."""
    digest = hashlib.sha256()
    for folder in dict.fromkeys((PACKAGE, package)):
        for path in sorted(folder.rglob("*.py")):
            text, place = path.read_bytes(), path.relative_to(folder)
            if b"@compiled" in text or place.parts[0] in LAYOUT:
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


class _Announcer(event.Listener):
    """Says on stderr that code is being compiled: numba itself tells, so nothing is said from a warm cache.

    A first reset compiles, and so does the first step behind it: what comes after a while is said again.
    """

    def __init__(self) -> None:
        self._depth, self._ended = 0, -math.inf

    def on_start(self, event: event.Event) -> None:
        """A function begins to be compiled; those that are not kept on disk are small and not worth a word."""
        self._depth += _kept(event)
        if _kept(event) and self._depth == 1 and time.monotonic() - self._ended > QUIET:
            print(
                "dms_core: compiling what is new, kept on disk (seconds; about a minute the very first time) ...",
                file=sys.stderr,
                flush=True,
            )

    def on_end(self, event: event.Event) -> None:
        """The pause between two stretches of compiling begins where the outermost function is done."""
        self._depth -= _kept(event)
        if _kept(event) and self._depth == 0:
            self._ended = time.monotonic()


def _kept(event: event.Event) -> bool:
    """Whether what is compiled is kept on disk."""
    return not isinstance(event.data["dispatcher"]._cache, NullCache)


_announcer: _Announcer | None = None


def announce() -> None:
    """From now on, say on stderr when something has to be compiled, once for each stretch of it."""
    global _announcer
    if _announcer is None:
        _announcer = _Announcer()
        event.register("numba:compile", _announcer)

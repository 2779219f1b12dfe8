"""Machine code on disk: kept while the sources are the same, dropped when they change, announced when it is missing.

numba keeps compiled functions beside their source and compiles one anew when its own file changes, but not when a
function that it calls from another file does. After an update of some files, machine code of the old version would run
in silence; so all of it is dropped whenever any compiled source of the package has changed.
"""

from __future__ import annotations

import contextlib
import hashlib
import sys
from pathlib import Path

from numba.core import event
from numba.core.caching import NullCache

PACKAGE = Path(__file__).parent
STAMP = "compiled_sources.sha256"


LAYOUT = ("assembly", "jit.py")
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
    """Says once, on stderr, that code is being compiled: numba itself tells, so nothing is said from a warm cache."""

    def __init__(self) -> None:
        self.silent = False

    def on_start(self, event: event.Event) -> None:
        """A function begins to be compiled; those that are not kept on disk are small and not worth a word."""
        if not self.silent and not isinstance(event.data["dispatcher"]._cache, NullCache):
            self.silent = True
            print(
                "dms_core: compiling what is new, kept on disk (seconds; about a minute the very first time) ...",
                file=sys.stderr,
                flush=True,
            )

    def on_end(self, event: event.Event) -> None:
        """Nothing to say."""


_announcer: _Announcer | None = None


def announce() -> None:
    """From now on, say once on stderr when something has to be compiled."""
    global _announcer
    if _announcer is None:
        _announcer = _Announcer()
        event.register("numba:compile", _announcer)

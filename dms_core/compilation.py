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

PACKAGE = Path(__file__).parent
STAMP = PACKAGE / "__pycache__" / "compiled_sources.sha256"
SEEN = "step_control.advance"
"""The last function that a first run compiles: where its machine code is on disk, so is the rest."""


def fingerprint() -> str:
    """Hash of every source file that holds compiled functions."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_bytes()
        if b"njit" in text:
            digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + text)
    return digest.hexdigest()


def drop_stale_code() -> None:
    """Remove numba's files of this package if they belong to other sources. Without write access nothing is done."""
    now = fingerprint()
    with contextlib.suppress(OSError):
        if STAMP.is_file() and STAMP.read_text() == now:
            return
        for pattern in ("*.nbi", "*.nbc"):
            for path in PACKAGE.rglob(f"__pycache__/{pattern}"):
                path.unlink(missing_ok=True)
        STAMP.parent.mkdir(exist_ok=True)
        STAMP.write_text(now)


def is_cold() -> bool:
    """True if a run will have to compile first."""
    return not any((PACKAGE / "simulation" / "__pycache__").glob(f"{SEEN}*.nbi"))


_announced = False


def announce() -> None:
    """Say once, on stderr, that the first run compiles."""
    global _announced
    if not _announced and is_cold():
        print("dms_core: first use, compiling to machine code (about half a minute, kept on disk) ...", file=sys.stderr)
    _announced = True

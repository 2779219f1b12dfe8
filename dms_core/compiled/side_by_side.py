"""The very first run compiles in two processes, since numba compiles one function at a time in each.

Some code is the same for every model: the choice of an elimination order, the parts of a step, what another package
builds on them. A second process compiles such code while the first one compiles the kernels of its model. It leaves
machine code on disk, where the first one finds it; a helper function that both need is compiled twice.

The work is a row of functions "module:name" without arguments; each is run, and said to be done, in its turn.
"""

from __future__ import annotations

import atexit
import contextlib
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from dms_core.compiled.compilation import announce_waiting
from dms_core.compiled.threads import processors

COMMAND = "import sys; from dms_core.compiled.side_by_side import work; work(sys.argv[1:])"

_registered: list[str] = []
_process: subprocess.Popen | None = None
_done: set[str] = set()


def register(work: str) -> None:
    """From now on, the second process also runs this function of another package, which compiles some of its code."""
    if work not in _registered:
        _registered.append(work)


def registered() -> list[str]:
    """The work of other packages."""
    return list(_registered)


def begin(work: Sequence[str], last: Any) -> None:
    """Start the second process if there is a processor for it and machine code of the function `last` is missing."""
    global _process
    # Processes of a pool leave it to their parent, which has begun already.
    if _process is not None or multiprocessing.parent_process() is not None or not sys.executable:
        return
    if processors() < 2 or _on_disk(last):
        return
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p or os.getcwd() for p in sys.path)}
    with contextlib.suppress(OSError):
        _process = subprocess.Popen(
            [sys.executable, "-c", COMMAND, *work],
            env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        atexit.register(_end, _process)


def _end(process: subprocess.Popen) -> None:
    """End the second process, which leaves nothing behind."""
    process.kill()
    process.communicate()


def wait_for(work: str) -> None:
    """Return when the second process has done this; at once where there is none, or where it has ended."""
    if _process is None or work in _done or _process.stdout is None:
        return
    announce_waiting()
    while work not in _done and (line := _process.stdout.readline()):
        _done.add(line.strip())


def work(names: Sequence[str]) -> None:
    """What the second process does: run the functions, and print the name of each when it is done."""
    for name in names:
        module, _, function = name.partition(":")
        getattr(import_module(module), function)()
        print(name, flush=True)


def _on_disk(function: Any) -> bool:
    """Whether there is machine code of a function that fits, or no place to keep any."""
    kept = function._cache
    return kept.cache_path is None or kept.fits

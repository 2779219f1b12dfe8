"""Timing on machines whose speed drifts: CPU seconds of the process, scaled by a fixed lump of work before and after.

`normalised` times are those of a machine on which the lump (PBKDF2-HMAC-SHA256, 40,000 rounds) takes 10 ms. Other
programs are timed by this same file (peers/), so it needs nothing but Python.
"""

from __future__ import annotations

import hashlib
import statistics
import time
from collections.abc import Callable
from typing import Any

LUMP_MS = 10.0


def lump() -> float:
    """CPU milliseconds of the fixed work."""
    begin = time.process_time()
    hashlib.pbkdf2_hmac("sha256", b"elbow", b"exoskeleton", 40_000)
    return (time.process_time() - begin) * 1e3


def normalised(
    run: Callable[..., Any],
    repeats: int = 5,
    *,
    prepare: Callable[[], Any] | None = None,
    clock: Callable[[], float] = time.process_time,
) -> tuple[float, Any]:
    """(median normalised seconds of run(), its last value).

    Args:
        run: what is timed; takes the value of `prepare` where there is one.
        repeats: how often.
        prepare: called before each repeat, not timed.
        clock: process_time; perf_counter for work of several threads or processes, which wants a quiet machine.
    """
    times, value = [], None
    for _ in range(repeats):
        given = () if prepare is None else (prepare(),)
        before = lump()
        begin = clock()
        value = run(*given)
        used = clock() - begin
        times.append(used * LUMP_MS / (0.5 * (before + lump())))
    return statistics.median(times), value

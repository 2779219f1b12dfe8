"""Timing on machines whose speed drifts: process CPU seconds, scaled by a fixed lump of work timed before and after.

`normalised` times are those of a machine on which the lump (PBKDF2-HMAC-SHA256, 40,000 rounds) takes 10 ms; the figures
of other programs quoted in bench.py were taken with the same lump.
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


def normalised(run: Callable[[], Any], repeats: int = 5) -> tuple[float, Any]:
    """(median normalised CPU seconds of run(), its last value)."""
    times, value = [], None
    for _ in range(repeats):
        before = lump()
        begin = time.process_time()
        value = run()
        used = time.process_time() - begin
        times.append(used * LUMP_MS / (0.5 * (before + lump())))
    return statistics.median(times), value

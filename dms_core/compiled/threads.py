"""Threads that run compiled code side by side, without the Python lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait


def processors() -> int:
    """Number of processors that this process may use, where the system says so, or else of all."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Threads:
    """A team of threads, the one that calls among them.

    Args:
        most: largest number of threads that have something to do.
        count: number of threads; None takes one for each processor.

    Attributes:
        count: number of threads.
    """

    def __init__(self, most: int, count: int | None = None) -> None:
        self.count = min(most, count or processors())
        self._pool: ThreadPoolExecutor | None = None
        self._process = 0
        """Process in which the other threads were made."""

    def run(self, jobs: Sequence[Callable[[], object]]) -> None:
        """Run jobs side by side, at most `count`, to the end of all; the first one in the thread that calls."""
        others = list[Future]()
        try:
            if len(jobs) > 1:
                pool = self._others()
                others += [pool.submit(job) for job in jobs[1:]]
            jobs[0]()
        finally:
            _wait(others)
        for job in others:
            job.result()

    def _others(self) -> ThreadPoolExecutor:
        """The other threads; a process that was forked has those of its parent no more, and makes its own."""
        if self._pool is None or self._process != os.getpid():
            self._pool, self._process = ThreadPoolExecutor(self.count - 1), os.getpid()
        return self._pool

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None and self._process == os.getpid():
            self._pool.shutdown()
        self._pool, self.count = None, 1


def _wait(jobs: Sequence[Future]) -> None:
    """Wait to the end: an interrupt must not leave threads behind that still write."""
    interrupt = None
    while True:
        try:
            wait(jobs)
            break
        except KeyboardInterrupt as error:
            interrupt = error
    if interrupt is not None:
        raise interrupt

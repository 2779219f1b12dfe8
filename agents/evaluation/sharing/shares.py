"""Shares of a long work, done by processes of this machine; what comes of each is given as it is done."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from dms_core.errors import SimulationError

ShareOut = Callable[[Callable[..., Any], Sequence[tuple[Any, ...]]], Iterator[Any]]
"""Takes a function and the arguments of each share; gives what the calls return, in the order of the shares."""
FORGETTING = 0.5
"""In which a pool forgets the shares that it has not begun [s]."""


@contextlib.contextmanager
def processes(workers: int) -> Iterator[ShareOut]:
    """Processes of this machine, which end without a word when the user stops the command.

    Raises:
        SimulationError: one of them was killed, by the system where memory is short.
    """
    with ProcessPoolExecutor(workers, initializer=_leave_signals_alone) as pool:
        before = set(multiprocessing.active_children())
        try:
            yield lambda function, shares: pool.map(function, *zip(*shares, strict=True)) if shares else iter(())
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            # Its thread reports a traceback where a process ends while it still knows shares that were cancelled.
            time.sleep(FORGETTING)
            for child in set(multiprocessing.active_children()) - before:
                child.kill()
            raise
        except BrokenProcessPool:
            raise SimulationError(
                "a worker process was killed before its share was done; does the machine have memory for as many "
                "--workers? What is done is kept, and the same command goes on from there."
            ) from None


def _leave_signals_alone() -> None:
    """Ctrl-C reaches every process of a terminal; this one leaves it to its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

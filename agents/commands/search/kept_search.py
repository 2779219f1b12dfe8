"""A search in a command: shared out, with a bar and the time that is left, its tries kept as they are done."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

from tqdm import tqdm

from dms_core.errors import Stopped

from ...evaluation.search.tries import KeptTries, Try
from ...evaluation.sharing.shares import ShareOut
from ..options import sharing_out


@contextlib.contextmanager
def kept_search(
    kept: KeptTries, total: int, workers: int, address: str | None
) -> Iterator[tuple[ShareOut, Callable[[Try], None]]]:
    """What does the shares of a search, and what is to be called with each try.

    Args:
        kept: the file that tries are kept in.
        total: tries of the whole search.
        workers: processes.
        address: of a Ray cluster, as for `sharing_out`.

    Raises:
        Stopped: by the user; the same command goes on from there.
    """
    try:
        with (
            sharing_out(workers, address) as share_out,
            tqdm(
                total=total, initial=kept.count, unit="try", leave=False, disable=None, file=sys.stderr
            ) as bar,
        ):  # fmt: skip

            def progress(one: Try) -> None:
                kept.add(one)
                bar.set_description(one.policy)
                bar.update()

            yield share_out, progress
    except KeyboardInterrupt:
        if not kept.count:
            raise
        said = f"{kept.count} of {total} tries are in '{kept.path}'; the same command goes on from there."
        raise Stopped(said) from None

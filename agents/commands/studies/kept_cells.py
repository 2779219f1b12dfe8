"""Cells of a table that takes long, run with a bar and the time that is left, and kept as they are done."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from dms_core.errors import Stopped

from ...evaluation.sharing.kept_shares import Cell, KeptShares, Planned, Work, beside_folder
from ..options import sharing_out


def run_cells(
    work: Work, cells: Sequence[Cell], out: Path, workers: int, address: str | None
) -> list[list[dict[str, Any]]]:
    """What the work gives for each cell; what is done is kept beside the folder `out` until it is forgotten.

    Args:
        work: run on each share of a cell.
        cells: policies, and what they are run on.
        out: folder of the results.
        workers: processes.
        address: of a Ray cluster, as for `sharing_out`.

    Raises:
        Stopped: by the user; the same command goes on from there.
    """
    kept, planned = KeptShares(beside_folder(out)), Planned(work, cells)
    known, total = planned.count(kept.done), planned.count()
    try:
        with (
            sharing_out(workers, address) as share_out,
            tqdm(
                total=total, initial=known, unit="episode", leave=False, disable=None, file=sys.stderr
            ) as bar,
        ):  # fmt: skip

            def progress(name: str, cases: int) -> None:
                bar.set_description(name, refresh=False)
                bar.update(cases)

            return planned.fill(kept, share_out, progress)
    except KeyboardInterrupt:
        done = planned.count(kept.done)
        if not done:
            raise
        said = f"{done} of {total} episodes are in '{kept.path}'; the same command goes on from there."
        raise Stopped(said) from None

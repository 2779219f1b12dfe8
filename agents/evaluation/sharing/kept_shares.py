"""Shares of a long evaluation in a file, one a line, so that a command that was killed goes on from there.

A share stands under a digest of everything that its episodes depend on: the policy with its numbers or weights, the
environment, its settings and the patients. So nothing of another command is ever taken for it, and shares that two
tables have in common are run once. A line that a kill left unfinished is dropped.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dms_core.files.json_text import finite
from dms_core.files.output_place import check_kind, put

from ...policies.batch_policy import BatchPolicy
from ...policies.learned import LearnedPolicy
from ...policies.policy import Policy
from ...provenance import package_version
from ..comparison.evaluate import Case, Plan
from .shares import ShareOut

LARGEST_SHARE = 10
"""Episodes of a share: some seconds, so that little is lost."""
Work = Callable[[Policy, Plan, Sequence[Case]], list[dict[str, Any]]]
"""Runs a policy and gives something JSON-able for each case; a function of a module that workers can import."""
Cell = tuple[Policy, Plan]
"""A policy, and what it is run on."""
Share = tuple[Policy, Plan, list[Case]]
"""A policy, and some of the cases of what it is run on."""


def beside_folder(out: Path) -> Path:
    """File for the shares of a folder of results that are not done yet: run.partial.jsonl for the folder run."""
    place = out.resolve()
    return place.with_name(f"{place.name}.partial.jsonl")


def forget(out: Path) -> None:
    """Remove the kept shares, whose results stand in the folder `out` now."""
    beside_folder(out).unlink(missing_ok=True)


class KeptShares:
    """Shares that are done, by their digest.

    Args:
        path: of the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = check_kind(path)
        self.done: dict[str, list[dict[str, Any]]] = {}
        if path.exists():
            lines = path.read_bytes().split(b"\n")
            for line in lines[:-1]:
                found = _read(line)
                if found is not None:
                    self.done[found[0]] = found[1]
            whole = b"".join(_line(key, content) for key, content in self.done.items())
            put(self.path, lambda file: file.write(whole))

    def add(self, key: str, content: list[dict[str, Any]]) -> None:
        """Keep one more, on the disk before this returns.

        Raises:
            OSError: the disk is full or cannot be written.
        """
        self.done[key] = content
        with self.path.open("ab") as file:
            file.write(_line(key, content))
            file.flush()
            os.fsync(file.fileno())


class Planned:
    """The shares of some cells, each once whatever number of cells it is in.

    Args:
        work: run on each share.
        cells: policies, and what they are run on.
    """

    def __init__(self, work: Work, cells: Sequence[Cell]) -> None:
        self.work = work
        self.shares: dict[str, Share] = {}
        """By digest."""
        self._of_cells: list[list[str]] = []
        for one, plan in cells:
            cases = plan.cases
            shares = [(one, plan, cases[k : k + LARGEST_SHARE]) for k in range(0, len(cases), LARGEST_SHARE)]
            keys = [digest(work, *share) for share in shares]
            self.shares |= dict(zip(keys, shares, strict=True))
            self._of_cells.append(keys)

    def count(self, known: Mapping[str, Any] | None = None) -> int:
        """Number of cases of all shares, or of those that are known."""
        return sum(len(cases) for key, (_, _, cases) in self.shares.items() if known is None or key in known)

    def fill(
        self, kept: KeptShares, share_out: ShareOut, progress: Callable[[str, int], None]
    ) -> list[list[dict[str, Any]]]:
        """What the work gives for each cell, a list with an entry a case.

        Args:
            kept: shares that are done; further ones are added.
            share_out: does the shares.
            progress: called for each share that was not known, with the name of the policy and the number of cases.
        """
        left = {key: share for key, share in self.shares.items() if key not in kept.done}
        for (key, share), found in zip(left.items(), share_out(self.work, list(left.values())), strict=True):
            kept.add(key, finite(found))
            progress(share[0].name, len(share[2]))
        return [[case for key in keys for case in kept.done[key]] for keys in self._of_cells]


def digest(work: Work, one: Policy, plan: Plan, cases: Sequence[Case]) -> str:
    """A digest of everything that the episodes of a share depend on."""
    own: Any = None
    if isinstance(one, LearnedPolicy):
        own = hashlib.sha256(b"".join(one.arrays[name].tobytes() for name in sorted(one.arrays))).hexdigest()
    elif isinstance(one, BatchPolicy):
        own = getattr(one, "numbers", None)
    facts = [
        work.__name__, package_version(), type(one).__module__, type(one).__qualname__, one.name, own, plan.id,
        plan.patient, plan.settings, cases,
    ]  # fmt: skip
    return hashlib.sha256(json.dumps(finite(facts), sort_keys=True).encode()).hexdigest()


def _line(key: str, content: list[dict[str, Any]]) -> bytes:
    return json.dumps([key, content]).encode() + b"\n"


def _read(line: bytes) -> tuple[str, list[dict[str, Any]]] | None:
    """Digest and content of a line; None where it is not whole."""
    try:
        key, content = json.loads(line)
    except (ValueError, TypeError, RecursionError):
        return None
    return (key, content) if isinstance(key, str) and isinstance(content, list) else None

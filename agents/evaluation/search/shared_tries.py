"""The tries of one policy, shared out in shares of some seconds; those that are known are not done again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..sharing.shares import ShareOut
from .tries import Try


@dataclass
class SharedTries:
    """How tries of a policy are done, and those that are."""

    work: Callable[..., list[Try]]
    """Called with policy, rows of numbers and `given`; gives a try for each row."""
    policy: str
    given: tuple[Any, ...]
    size: int
    """Rows of a share."""
    share_out: ShareOut
    progress: Callable[[Try], None] = lambda one: None
    """Called with each try that was not known."""
    _done: dict[tuple[float, ...], Try] = field(default_factory=dict)

    def know(self, tries: Iterable[Try]) -> None:
        """Tries that were done before."""
        self._done |= {tuple(one.numbers.values()): one for one in tries}

    def at(self, rows: Sequence[Mapping[str, float]]) -> list[Try]:
        """The try of each row of numbers, in their order."""
        left = [row for row in rows if tuple(row.values()) not in self._done]
        shares = [(self.policy, left[k : k + self.size], *self.given) for k in range(0, len(left), self.size)]
        for found in self.share_out(self.work, shares):
            for one in found:
                self.know([one])
                self.progress(one)
        return [self._done[tuple(row.values())] for row in rows]

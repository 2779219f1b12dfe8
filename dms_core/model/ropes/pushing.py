"""The limit of every rope: it cannot push."""

from __future__ import annotations

from typing import Literal

from dms_core.model.element import Limit

NO_TENSION = 1e-6
"""Tension that counts as 0 where it is solved for [N]: what rounding leaves of a slack rope."""
LARGEST_ERROR = 1e-2
"""Share of a run's largest tension above which a negative one is flagged however coarse the run is."""


def no_push(of: Literal["coordinate", "multiplier", "input"], name: str, said: str) -> tuple[Limit, ...]:
    """The limit of a tension [N]: not below 0.

    Args:
        of: what the tension is. An input is exact; what is solved for is as good as the run.
        name: its full name.
        said: what is so below 0.
    """
    if of == "input":
        return (Limit(of, name, "N", low=0.0, below=said),)
    return (Limit(of, name, "N", low=-NO_TENSION, below=said, share=LARGEST_ERROR),)

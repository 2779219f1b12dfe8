"""An evaluation with its episodes shared out by Ray."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..evaluation.comparison.evaluate import Plan, episodes_of, results_of
from ..policies.policy import Policy
from .cluster import share_out

LARGEST_SHARE = 10
"""Episodes of a share: some seconds, so that little is lost with a worker."""


def shared_out(
    policies: Sequence[Policy],
    plan: Plan,
    *,
    address: str | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """What `evaluate` returns.

    Args:
        policies: to compare.
        plan: what they are run on.
        address: of a cluster, as in `share_out`.
        progress: called with the name of the policy after each episode.
    """
    cases = plan.cases
    parts = [cases[k : k + LARGEST_SHARE] for k in range(0, len(cases), LARGEST_SHARE)]
    shares = [(one, plan, part) for one in policies for part in parts]

    def done(k: int) -> None:
        if progress is not None:
            for _ in shares[k][2]:
                progress(shares[k][0].name)

    results = share_out(episodes_of, shares, address=address, done=done)
    n = len(parts)
    joined = [[e for part in results[k * n : (k + 1) * n] for e in part] for k in range(len(policies))]
    return results_of(policies, joined, plan)

"""The evaluation of evaluate.py with its episodes shared out by Ray."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from agents.distributed.cluster import share_out
from agents.evaluation.evaluate import cases_of, check_numbers, episodes_of, results_of
from agents.policies.policy import Policy
from exo_env.patient.population import Source, population

LARGEST_SHARE = 10
"""Episodes of a share: some seconds, so that little is lost with a worker."""


def evaluate_by_ray(
    policies: Sequence[Policy],
    patients_of: Source,
    patients: int,
    seed: int,
    *,
    loads: Sequence[float] = (),
    address: str | None = None,
    cpus: int | None = None,
    progress: Callable[[str], None] | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """As `evaluate`; `address` and `cpus` as in `share_out`."""
    check_numbers(patients, seed)
    source, cases = population(patients_of), cases_of(seed, patients, loads)
    parts = [cases[k : k + LARGEST_SHARE] for k in range(0, len(cases), LARGEST_SHARE)]
    shares = [(one, source.model_dump(), part, settings) for one in policies for part in parts]

    def done(k: int) -> None:
        if progress is not None:
            for _ in shares[k][2]:
                progress(shares[k][0].name)

    found = share_out(episodes_of, shares, address=address, cpus=cpus, done=done)
    n = len(parts)
    joined = [[e for part in found[k * n : (k + 1) * n] for e in part] for k in range(len(policies))]
    return results_of(policies, joined, source.title, patients, seed, loads, settings)

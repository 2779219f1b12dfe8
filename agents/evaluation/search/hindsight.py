"""The best of each family with hindsight: for each patient, the best of many tries with this patient.

Tries are the tuned numbers, a Latin hypercube over the ranges, and as many near the tuned numbers. No policy knows
beforehand which of them will be best; what they reach bounds what a better choice of numbers, patient by patient, could
give to a family.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from dms_core.errors import InputError

from ...environment import patient_seeds
from ...policies.baselines import REFERENCE_FREE
from ...policies.tuned import HIDDEN_INTENT, Range, tuned
from ..comparison.evaluate import check_numbers
from ..comparison.statistics import estimate, mean
from ..sharing.shares import ShareOut
from .batch_trials import batch_returns
from .shared_tries import SharedTries
from .tries import Try
from .tuning import around, first_places, numbers_at, share_sizes


def tried_numbers(policy: str, tries: int, seed: int) -> list[dict[str, float]]:
    """Numbers of each try, the tuned ones first.

    Args:
        policy: one of REFERENCE_FREE.
        tries: how many.
        seed: of the search.
    """
    ranges = REFERENCE_FREE[policy].ranges
    generator, best = np.random.default_rng(seed), tuned(HIDDEN_INTENT)[policy]
    wide = first_places(len(ranges), (tries - 1) // 2, generator)
    near = around(np.array([place(r, best[name]) for name, r in ranges.items()]), tries - 1 - len(wide), generator)
    return [dict(best), *(numbers_at(ranges, x) for x in (*wide, *near))]


def place(r: Range, number: float) -> float:
    """Where a number lies in its range, from 0 to 1; `Range.at` takes it back but for rounding."""
    if r.logarithmic:
        return float(np.log(number / r.low) / np.log(r.high / r.low))
    return (number - r.low) / (r.high - r.low)


def patient_returns(
    policy: str, rows: Sequence[Mapping[str, float]], seeds: Sequence[int], population: str, environment: str,
    settings: Mapping[str, Any],
) -> list[Try]:  # fmt: skip
    """The return with each patient, by the seed of the episode, with each row of numbers."""
    returns, _ = batch_returns(REFERENCE_FREE[policy], rows, seeds, population, environment, settings)
    return [
        Try(policy, dict(row), {str(seed): float(x) for seed, x in zip(seeds, found, strict=True)})
        for row, found in zip(rows, returns, strict=True)
    ]


def hindsight(
    policy: str,
    tries: int,
    patients: int,
    seed: int,
    *,
    population: str,
    environment: str,
    share_out: ShareOut,
    known: Iterable[Try] = (),
    progress: Callable[[Try], None] = lambda one: None,
    **settings: Any,
) -> list[Try]:
    """All tries of a policy, the tuned numbers first.

    Args:
        policy: one with numbers to tune.
        tries: how many.
        patients: how many.
        seed: of the patients and of the tries.
        population: of the patients, by name or YAML file.
        environment: its id.
        share_out: does the tries.
        known: tries that are done; they are not done again.
        progress: called with each try that was not known.
        settings: further ones of the environment.

    Raises:
        InputError: a number is not usable.
    """
    check_numbers(patients, seed)
    if tries < 2:
        raise InputError(f"tries = {tries}: expected a whole number from 2.")
    rows, seeds = tried_numbers(policy, tries, seed), patient_seeds(seed, patients)
    given = seeds, population, environment, settings
    shared = SharedTries(patient_returns, policy, given, share_sizes(policy, patients), share_out, progress)
    shared.know(known)
    return shared.at(rows)


def summed_up(tries: Mapping[str, Sequence[Try]], seed: int) -> list[dict[str, Any]]:
    """A row a policy: mean return with the tuned numbers and with hindsight, and how much the second is above.

    Args:
        tries: of each policy, as `hindsight` gives them.
        seed: of the bootstrap.
    """
    rows = []
    for name, ones in tries.items():
        returns = np.array([list(one.measures.values()) for one in ones])
        best = returns.max(axis=0)
        columns = {"tuned": returns[0], "hindsight": best, "gain": best - returns[0]}
        rows.append(
            {"policy": name}
            | {key: asdict(estimate(x, mean, np.random.default_rng(seed))) for key, x in columns.items()}
        )
    return rows


def tuned_difference(one: Sequence[Try], other: Sequence[Try], seed: int) -> dict[str, float]:
    """Estimate of the mean difference between two policies with their tuned numbers, patient by patient."""
    first, second = (np.array(list(tries[0].measures.values())) for tries in (one, other))
    return asdict(estimate(first - second, mean, np.random.default_rng(seed)))

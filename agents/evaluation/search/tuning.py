"""Search for the numbers of the baselines that give the best return on the training population.

First a Latin hypercube over the ranges, then as many tries again around the best one so far, normally distributed with
a tenth of each range. Every try meets the same patients, which are not those of an evaluation; what counts is the mean
return, in which an unsafe episode weighs as much as it costs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np

from dms_core.errors import InputError

from ...environment import ENVIRONMENT, hides_plan, patient_seeds
from ...policies.baselines import FOLLOWING, POLICIES, REFERENCE_FREE
from ...policies.batch_policy import BatchPolicy
from ...policies.learned import SHIPPED, LearnedPolicy, shipped_policies
from ...policies.policy import Policy
from ...policies.tuned import Range
from ..episodes.episode import judged, world_of
from ..sharing.shares import ShareOut, processes
from .batch_trials import batch_returns
from .shared_tries import SharedTries
from .tries import Try

POPULATION, STREAM = "mixed", 2**32
"""Training population by default; STREAM is added to a seed, so that no patients are those of an evaluation with it."""
SPREAD = 0.1
"""Standard deviation around the best, as a share of each range."""
BATCH = 8
"""Tries of the second half that go out from the same best one."""
WORLDS = 160
"""Worlds of a batch at most, where a try has fewer patients: a share of some seconds."""
MEASURED = ("return", "tracking_rms_deg", "device_work_share", "peak_reaction_N", "unsafe")


def baselines_of(environment: str) -> Mapping[str, type[Policy]]:
    """The policies to compare with in an environment, by name."""
    return REFERENCE_FREE if hides_plan(environment) else FOLLOWING


def tunable(environment: str = ENVIRONMENT) -> dict[str, dict[str, Range]]:
    """Ranges of every policy of an environment that has numbers to tune."""
    return {name: kind.ranges for name, kind in baselines_of(environment).items() if kind.ranges}


def trial(
    policy: str, numbers: Mapping[str, float], population: str, seeds: Sequence[int], settings: Mapping[str, Any],
    environment: str = ENVIRONMENT,
) -> Try:  # fmt: skip
    """Means over the episodes of some seeds."""
    acting = POLICIES[policy](**numbers)
    env = world_of(acting, population, environment, **settings)
    measures = judged(env, acting, seeds)
    env.close()
    known = [name for name in MEASURED if name in measures[0]]
    return Try(policy, dict(numbers), {name: float(np.nanmean([m[name] for m in measures])) for name in known})


def trials(
    policy: str, rows: Sequence[Mapping[str, float]], population: str, seeds: Sequence[int],
    settings: Mapping[str, Any], environment: str = ENVIRONMENT,
) -> list[Try]:  # fmt: skip
    """Means over the episodes of some seeds with each row of numbers; policies over arrays act in one batch."""
    kind = POLICIES[policy]
    if not issubclass(kind, BatchPolicy):
        return [trial(policy, row, population, seeds, settings, environment) for row in rows]
    means = [x.mean(axis=1) for x in batch_returns(kind, rows, seeds, population, environment, settings)]
    return [
        Try(policy, dict(row), {"return": float(returned), "unsafe": float(unsafe)})
        for row, returned, unsafe in zip(rows, *means, strict=True)
    ]


def share_sizes(policy: str, patients: int) -> int:
    """Tries of a share: one episode after the other, or a batch of worlds."""
    return max(WORLDS // patients, 1) if issubclass(POLICIES[policy], BatchPolicy) else 1


def tune(
    policy: str,
    tries: int,
    patients: int,
    seed: int,
    *,
    population: str = POPULATION,
    environment: str = ENVIRONMENT,
    workers: int = 1,
    share_out: ShareOut | None = None,
    known: Iterable[Try] = (),
    progress: Callable[[Try], None] = lambda one: None,
    **settings: Any,
) -> list[Try]:
    """Tries of a policy, best first.

    Args:
        policy: one of `tunable`.
        tries: how many.
        patients: episodes of each.
        seed: of the patients and of the search.
        population: of the patients, by name or YAML file.
        environment: its id.
        workers: processes.
        share_out: does the tries, in place of processes that begin and end with this search.
        known: tries of the same search that are done; they are not done again.
        progress: called with each try that was not known.
        settings: further ones of the environment.

    Raises:
        InputError: the policy has nothing to tune, or a number is not usable.
    """
    _check(policy, environment, tries=(tries, 2), patients=(patients, 1), seed=(seed, 0), workers=(workers, 1))
    given = population, patient_seeds(STREAM + seed, patients), settings, environment
    with processes(workers) if share_out is None else nullcontext(share_out) as each:
        shared = SharedTries(trials, policy, given, share_sizes(policy, patients), each, progress)
        shared.know(known)
        return _best_first(shared, tries, np.random.default_rng(seed))


def _check(policy: str, environment: str, **numbers: tuple[int, int]) -> None:
    """Refuse what cannot be searched; numbers each with the least that it may be."""
    if policy not in tunable(environment):
        raise InputError(f"policy '{policy}' has nothing to tune; there are {', '.join(tunable(environment))}.")
    for name, (value, least) in numbers.items():
        if not isinstance(value, int) or value < least:
            raise InputError(f"{name} = {value!r}: expected a whole number from {least}.")


def _best_first(shared: SharedTries, tries: int, generator: np.random.Generator) -> list[Try]:
    """The search itself: spread over the ranges, then around the best one so far."""
    ranges = POLICIES[shared.policy].ranges
    places, done = first_places(len(ranges), tries // 2, generator), list[tuple[np.ndarray, Try]]()
    while True:
        done += zip(places, shared.at([numbers_at(ranges, place) for place in places]), strict=True)
        if len(done) >= tries:
            return [one for _, one in sorted(done, key=_return, reverse=True)]
        best = max(done, key=_return)[0]
        places = around(best, min(BATCH, tries - len(done)), generator)


def untuned(patients: int, seed: int, *, population: str, environment: str, **settings: Any) -> dict[str, float]:
    """Mean return of who has nothing to tune, on the patients of a search: none, and shipped policies told the plan.

    Args:
        patients: episodes of each.
        seed: of the search.
        population: of the patients, by name or YAML file.
        environment: its id; it hides the patient's plan.
        settings: further ones of the environment.
    """
    seeds, found = patient_seeds(STREAM + seed, patients), dict[str, float]()
    learned = [LearnedPolicy.load(SHIPPED / name, name) for name in shipped_policies()]
    told = [one for one in learned if one.informed and one.knows(environment)]
    for one in (*(kind() for kind in baselines_of(environment).values() if not kind.ranges), *told):
        env = world_of(one, population, environment, **settings)
        found[one.name] = float(np.mean([m["return"] for m in judged(env, one, seeds)]))
        env.close()
    return found


def first_places(dimensions: int, count: int, generator: np.random.Generator) -> np.ndarray:
    """A Latin hypercube, shape (count, dimensions), from 0 to 1."""
    # A large package, which commands that search nothing do without.
    from scipy.stats import qmc

    return qmc.LatinHypercube(dimensions, rng=generator).random(count)


def around(place: np.ndarray, count: int, generator: np.random.Generator) -> np.ndarray:
    """Places near one, shape (count, dimensions), from 0 to 1."""
    return np.clip(place + SPREAD * generator.standard_normal((count, len(place))), 0.0, 1.0)


def numbers_at(ranges: Mapping[str, Range], place: np.ndarray) -> dict[str, float]:
    """The numbers at a place, from 0 to 1 in every range."""
    return {name: r.at(x) for (name, r), x in zip(ranges.items(), place, strict=True)}


def _return(entry: tuple[np.ndarray, Try]) -> float:
    return entry[1].measures["return"]

"""Search for the numbers of the baselines that give the best return on the training population.

First a Latin hypercube over the ranges, then as many tries again around the best one so far, normally distributed with
a tenth of each range. Every try meets the same patients, which are not those of an evaluation; what counts is the mean
return, in which an unsafe episode weighs as much as it costs.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from typing import Any

import numpy as np
from scipy.stats import qmc

from dms_core.errors import InputError

from ..environment import ENVIRONMENT, patient_seeds
from ..policies.baselines import POLICIES
from ..policies.tuned import Range
from .episode import judged, world_of

POPULATION, STREAM = "mixed", 2**32
"""Training population by default; STREAM is added to a seed, so that no patients are those of an evaluation with it."""
SPREAD = 0.1
"""Standard deviation around the best, as a share of each range."""
FORGETTING = 0.5
"""In which a pool forgets the tries that it has not begun [s]."""
BATCH = 8
"""Tries of the second half that go out from the same best one."""
MEASURED = ("return", "tracking_rms_deg", "device_work_share", "peak_reaction_N", "unsafe")


@dataclass(frozen=True)
class Try:
    """Numbers, and the mean of some measures with them."""

    policy: str
    numbers: dict[str, float]
    measures: dict[str, float]


def tunable() -> dict[str, dict[str, Range]]:
    """Ranges of every policy that has numbers to tune."""
    return {name: kind.ranges for name, kind in POLICIES.items() if kind.ranges}


def trial(
    policy: str, numbers: dict[str, float], population: str, seeds: list[int], settings: dict[str, Any],
    environment: str = ENVIRONMENT,
) -> Try:  # fmt: skip
    """Means over the episodes of some seeds."""
    acting = POLICIES[policy](**numbers)
    env = world_of(acting, population, environment, **settings)
    measures = judged(env, acting, seeds)
    env.close()
    known = [name for name in MEASURED if name in measures[0]]
    return Try(policy, numbers, {name: float(np.nanmean([m[name] for m in measures])) for name in known})


def tune(
    policy: str,
    tries: int,
    patients: int,
    seed: int,
    *,
    population: str = POPULATION,
    environment: str = ENVIRONMENT,
    workers: int = 1,
    progress: Callable[[Try], None] | None = None,
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
        progress: called with each try.
        settings: further ones of the environment.

    Raises:
        InputError: the policy has nothing to tune, or a number is not usable.
    """
    if policy not in tunable():
        raise InputError(f"policy '{policy}' has nothing to tune; there are {', '.join(tunable())}.")
    for name, value, least in (
        ("tries", tries, 2),
        ("patients", patients, 1),
        ("seed", seed, 0),
        ("workers", workers, 1),
    ):
        if not isinstance(value, int) or value < least:
            raise InputError(f"{name} = {value!r}: expected a whole number from {least}.")
    ranges, seeds = tunable()[policy], patient_seeds(STREAM + seed, patients)
    generator = np.random.default_rng(seed)
    done: list[tuple[np.ndarray, Try]] = []

    def run(places: np.ndarray, pool: ProcessPoolExecutor) -> None:
        """Try these places, each from 0 to 1 in every range."""
        rows = [{n: r.at(x) for (n, r), x in zip(ranges.items(), place, strict=True)} for place in places]
        tried = pool.map(
            trial, repeat(policy), rows, repeat(population), repeat(seeds), repeat(settings), repeat(environment)
        )
        for place, one in zip(places, tried, strict=True):
            done.append((place, one))
            if progress is not None:
                progress(one)

    with _pool(workers) as pool:
        first = tries // 2
        run(qmc.LatinHypercube(len(ranges), rng=generator).random(first), pool)
        while len(done) < tries:
            best = max(done, key=_return)[0]
            count = min(BATCH, tries - len(done))
            run(np.clip(best + SPREAD * generator.standard_normal((count, len(ranges))), 0.0, 1.0), pool)
    return [one for _, one in sorted(done, key=_return, reverse=True)]


@contextlib.contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that end without a word when the user stops the command."""
    with ProcessPoolExecutor(workers, initializer=_leave_signals_alone) as pool:
        before = set(multiprocessing.active_children())
        try:
            yield pool
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            # Its thread reports a traceback where a process ends while it still knows tries that were cancelled.
            time.sleep(FORGETTING)
            for child in set(multiprocessing.active_children()) - before:
                child.kill()
            raise


def _leave_signals_alone() -> None:
    """Ctrl-C reaches every process of a terminal; this one leaves it to its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _return(entry: tuple[np.ndarray, Try]) -> float:
    return entry[1].measures["return"]

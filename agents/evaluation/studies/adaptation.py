"""How fast a policy gets used to a patient: the return of each window of a long episode, and its regret.

The return of a window is the sum of its rewards, so that the returns of all windows add up to that of the episode. An
episode that an event ends gives nothing for the windows that are left, as everywhere else in this package; the event
itself is paid for in its own window. An episode that ended is therefore no shorter sample but a bad one.

The regret of a window is what the best of a set of policies reached in this window with this patient, less what the
policy did; the best is picked with hindsight, for each patient and window anew. A policy of the set has no regret below
0; one that is told the plan may have.

The windows that a policy needs are counted up to the first one whose mean return R_k has nine tenths of the last one's,
and, as fatigue takes return from everybody, once more up to the first one whose mean regret Q_k has come nine tenths of
its way to the last one's:

    min {k : R_k >= R_n - 0.1 |R_n|}        min {k : Q_k <= Q_n + 0.1 |Q_1 - Q_n|}

Means are over the patients, who are resampled for the intervals.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dms_core.errors import InputError

from ...environment import make
from ...policies.baselines import REFERENCE_FREE
from ...policies.batch_policy import BatchPolicy
from ...policies.policy import Policy
from ..comparison.evaluate import Case, Plan
from ..comparison.statistics import CONFIDENCE, RESAMPLES, Estimate, estimate, mean
from ..episodes.episode import reset_options, world_of
from ..episodes.playing import Playing
from ..search.batch_trials import batch_steps
from ..search.hindsight import tried_numbers
from ..search.tuning import tunable

NEAR = 0.1
"""Part of a level, or of the way to it, that may be lacking."""


def windows_of(environment: str) -> int:
    """Number of windows of an episode.

    Raises:
        InputError: there is one, or they are no equal number of control periods.
    """
    world: Any = make(environment).unwrapped
    count = getattr(world.settings, "repetitions", 1)
    if count < 2 or world.steps % count:
        raise InputError(
            f"--env {environment}: its episodes have {count} windows in {world.steps} control periods; expected two or "
            "more windows of equal length, as exo/NewPatient-v0 has."
        )
    return count


def parts(rewards: Sequence[float], windows: int, steps: int) -> list[float]:
    """Return of each window, correctly rounded; 0 where the episode was over.

    Args:
        rewards: of the steps that were done.
        windows: how many.
        steps: in a whole episode.
    """
    each = steps // windows
    return [math.fsum(rewards[k * each : (k + 1) * each]) for k in range(windows)]


def window_returns(one: Policy, plan: Plan, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """Seed, return of each window, and whether an event ended the episode; policies over arrays as one batch."""
    env = world_of(one, plan.patient, plan.environment, **plan.settings)
    world: Any = env.unwrapped
    windows, steps = world.settings.repetitions, world.steps
    found = []
    if isinstance(one, BatchPolicy) and type(one) in REFERENCE_FREE.values():
        numbers: Any = one.numbers
        seeds = [seed for seed, _ in cases]
        done = list(batch_steps(type(one), [numbers], seeds, plan.patient, plan.environment, plan.settings))
        rewards, ended = (np.array([step[k][0] for step in done]) for k in range(2))
        for k, seed in enumerate(seeds):
            returns = parts(rewards[:, k].tolist(), windows, steps)
            found.append({"seed": seed, "windows": returns, "unsafe": bool(ended[:, k].any())})
    else:
        for seed, load in cases:
            playing = Playing(env, one, seed, reset_options(load))
            returns = parts([reward for reward, _ in playing.steps()], windows, steps)
            found.append({"seed": seed, "windows": returns, "unsafe": playing.event is not None})
    env.close()
    return found


def hindsight_set(environment: str, tries: int, seed: int) -> list[Policy]:
    """Policies among which the best is picked with hindsight: all tuned classical ones that are not told the plan.

    Args:
        environment: its id.
        tries: of each, with its tuned numbers first.
        seed: of the further numbers.
    """
    kinds = [REFERENCE_FREE[name] for name in tunable(environment)] + [REFERENCE_FREE["none"]]
    found: list[Policy] = []
    for kind in kinds:
        if not kind.informed:
            rows = tried_numbers(kind.name, tries, seed) if kind.ranges and tries > 1 else [{}]
            found += [kind(**row) for row in rows]
    return found


@dataclass(frozen=True)
class Adaptation:
    """What is known of a policy."""

    returns: list[Estimate]
    """Mean over the patients, a window each."""
    regrets: list[Estimate]
    return_windows: Estimate
    """Windows until the return is near that of the last one."""
    regret_windows: Estimate
    """Windows until the regret is near that of the last one."""
    unsafe: Estimate
    """Share of the episodes that an event ended."""


def best_of(sets: Sequence[Sequence[Mapping[str, Any]]]) -> np.ndarray:
    """The best return in each window with each patient, shape (patients, windows).

    Args:
        sets: what `window_returns` gave for each policy of the set.
    """
    return np.max([_windows(one) for one in sets], axis=0)


def adaptation(episodes: Sequence[Mapping[str, Any]], best: np.ndarray, seed: int) -> Adaptation:
    """The figures of a policy.

    Args:
        episodes: as `window_returns` gives them.
        best: from `best_of`, with the same patients.
        seed: of the bootstrap.
    """
    returns = _windows(episodes)
    unsafe = np.array([float(e["unsafe"]) for e in episodes])

    def each(columns: np.ndarray) -> list[Estimate]:
        return [estimate(x, mean, np.random.default_rng(seed)) for x in columns.T]

    return Adaptation(
        each(returns), each(best - returns), _needed(returns, near_return, seed),
        _needed(best - returns, near_regret, seed), estimate(unsafe, mean, np.random.default_rng(seed)),
    )  # fmt: skip


def _needed(values: np.ndarray, near: Callable[[np.ndarray], np.ndarray], seed: int) -> Estimate:
    """Windows until the mean is near that of the last one, with its interval.

    Args:
        values: of each patient and window, shape (patients, windows).
        near: `near_return` or `near_regret`.
        seed: of the bootstrap.
    """
    n, tail = len(values), 0.5 * (1.0 - CONFIDENCE)
    places = np.random.default_rng(seed).integers(n, size=(RESAMPLES, n))
    low, high = np.quantile(near(values[places].mean(axis=1)), (tail, 1.0 - tail))
    return Estimate(float(near(values.mean(axis=0)[None])[0]), float(low), float(high), n)


def near_return(levels: np.ndarray) -> np.ndarray:
    """The first window, from 1, whose return is near the last one's; shape (m, windows) gives (m,)."""
    last = levels[:, -1:]
    return 1.0 + np.argmax(levels >= last - NEAR * np.abs(last), axis=1)


def near_regret(levels: np.ndarray) -> np.ndarray:
    """The first window, from 1, whose regret is near the last one's; shape (m, windows) gives (m,)."""
    first, last = levels[:, :1], levels[:, -1:]
    return 1.0 + np.argmax(levels <= last + NEAR * np.abs(first - last), axis=1)


def _windows(episodes: Sequence[Mapping[str, Any]]) -> np.ndarray:
    """Returns, shape (patients, windows)."""
    return np.array([e["windows"] for e in episodes], dtype=float)

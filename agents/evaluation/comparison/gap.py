"""Gap closed: how far a policy goes on the way from the best classical policy with its sensors to an oracle.

    g = mean_i (R_i - B_i) / mean_i (O_i - B_i)

with the returns R of the policy, B of the opponent and O of the oracle on patient i. Patients, the same for all three,
and trainings are resampled; nothing is clipped. Where the interval of the denominator holds 0 there is no gap to close.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .by_patient import by_patient, by_training
from .statistics import CONFIDENCE, RESAMPLES

GAP = "gap_closed"
"""Its key in a summary."""
Episodes = list[dict[str, Any]]


def gap_closed(
    episodes: Episodes, opponent: Episodes, oracle: Episodes, seed: int, trainings: int = 1
) -> dict[str, Any]:
    """The gap closed, with its interval.

    Args:
        episodes: of a policy, or of several trainings one after another.
        opponent: of the best classical policy with the same sensors, with the same patients.
        oracle: of the oracle, with the same patients.
        seed: of the bootstrap.
        trainings: how many.

    Returns:
        "value", "low", "high" and "count" as an Estimate has them, and "reason", why they are NaN, or None.
    """
    low = by_patient(opponent, "return")
    gains, whole = by_training(episodes, "return", trainings) - low, by_patient(oracle, "return") - low
    generator = np.random.default_rng(seed)
    n, tail = len(low), 0.5 * (1.0 - CONFIDENCE)
    places = generator.integers(n, size=(RESAMPLES, n))
    drawn = generator.multinomial(trainings, np.full(trainings, 1.0 / trainings), size=RESAMPLES) / trainings
    above = np.mean(np.take_along_axis(drawn @ gains, places, axis=1), axis=1)
    below = whole[places].mean(axis=1)
    edges = np.quantile(below, (tail, 1.0 - tail))
    if edges[0] <= 0.0 <= edges[1]:
        reason = (
            f"the oracle's return is above the opponent's by {whole.mean():.3g} [{edges[0]:.3g}, {edges[1]:.3g}], "
            "which holds 0"
        )
        return {"value": math.nan, "low": math.nan, "high": math.nan, "count": n, "reason": reason}
    first, last = np.quantile(above / below, (tail, 1.0 - tail))
    value = float(gains.mean() / whole.mean())
    return {"value": value, "low": float(first), "high": float(last), "count": n, "reason": None}


def gaps(
    episodes: Mapping[str, Episodes], opponents: Mapping[str, str], oracle: str, seed: int
) -> dict[str, dict[str, Any]]:
    """The gap closed of each policy, with the names of its opponent and of the oracle.

    Args:
        episodes: of each policy, by name.
        opponents: name of the opponent of each policy that is measured, by its own.
        oracle: name of the oracle.
        seed: of the bootstrap.
    """
    return {
        name: {
            **gap_closed(episodes[name], episodes[opponent], episodes[oracle], seed),
            "opponent": opponent, "oracle": oracle,
        }
        for name, opponent in opponents.items()
    }  # fmt: skip


def pooled_gap(ones: Sequence[Mapping[str, Any]], everyone: Mapping[str, Any], kind: str, kept: Any, seed: int) -> Any:
    """The gap closed by several trainings together, None where they have none.

    Args:
        ones: the trainings, as `evaluate` returns them.
        everyone: all policies of the evaluation, by name.
        kind: of summary.
        kept: chooses among the episodes of a policy.
        seed: of the bootstrap.
    """
    known = [one[kind].get(GAP) for one in ones]
    named = {(gap["opponent"], gap["oracle"]) for gap in known if gap}
    if not all(known) or len(named) != 1 or not named <= {(a, b) for a in everyone for b in everyone}:
        return None
    ((opponent, oracle),) = named
    episodes = [e for one in ones for e in kept(one["episodes"])]
    low, high = (kept(everyone[name]["episodes"]) for name in (opponent, oracle))
    return {**gap_closed(episodes, low, high, seed, len(ones)), "opponent": opponent, "oracle": oracle}

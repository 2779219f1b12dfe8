"""Means of a measure over the episodes of each patient, which are no independent sample."""

from __future__ import annotations

from typing import Any

import numpy as np


def by_patient(episodes: list[dict[str, Any]], measure: str) -> np.ndarray:
    """Mean of a measure over the episodes of each patient, shape (n,); NaN where it could not be measured."""
    values: dict[int, list[float | None]] = {}
    for e in episodes:
        values.setdefault(e["seed"], []).append(e["measures"][measure])
    return np.array([np.mean([x for x in v if x is not None and np.isfinite(x)] or [np.nan]) for v in values.values()])


def by_training(episodes: list[dict[str, Any]], measure: str, trainings: int) -> np.ndarray:
    """`by_patient` of each training, shape (trainings, n)."""
    n = len(episodes) // trainings
    return np.array([by_patient(episodes[k * n : (k + 1) * n], measure) for k in range(trainings)])

"""Settings of the environment from what a user may give."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dms_core.config_files import configs
from dms_core.errors import InputError, choices
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.patient.distributions import Distribution, distribution

LEAST_LOAD, MOST_LOAD = 0.05, 50.0
"""Weights that the machine takes [kg]."""
SOLVER_OPTIONS: dict[str, Any] = {"method": "sdirk2", "newton_tol": 0.2, "h_min": 1e-9, "max_steps": 500_000}
"""A run that needs smaller steps [s], or more of them in an episode, has failed. Newton's method may leave a fifth of
the largest error of a step; with a twentieth, the default elsewhere, the elbow of 12 patients came no nearer to runs at
rtol 1e-6, in a third to a half more iterations."""
TIME = 6.0
"""Of one repetition [s]."""


def within(value: Any, low: float, high: float) -> bool:
    """Whether a value is a number between two limits."""
    return isinstance(value, int | float | np.number) and bool(low <= value <= high)


def load_distribution(load: float | Mapping[str, Any] | None) -> Distribution:
    """Distribution of the weight on the machine [kg]."""
    spec = {"uniform": [0.5, 2.0]} if load is None else load
    try:
        if isinstance(spec, float) and not np.isfinite(spec):
            raise InputError(f"a number from {LEAST_LOAD} to {MOST_LOAD} kg is wanted.")
        found = distribution(spec)
        if any(not within(x, LEAST_LOAD, MOST_LOAD) for x in found.limits()):
            raise InputError(f"numbers from {LEAST_LOAD} to {MOST_LOAD} kg are wanted.")
    except InputError as error:
        raise InputError(f"load = {load!r}: {error}") from None
    return found


def worn_device(source: str | Mapping[str, Any] | None) -> Exoskeleton:
    """A shipped device by name, or the default with some values changed."""
    shipped = sorted(p.stem for p in (configs() / "exoskeletons").glob("*.yaml"))
    if source is None or isinstance(source, Mapping):
        return Exoskeleton.from_config("exoskeletons/elbow.yaml").changed(**(source or {}))
    if source not in shipped:
        raise InputError(f"exoskeleton = {source!r}; a mapping or one of {choices(shipped)} is wanted.")
    return Exoskeleton.from_config(f"exoskeletons/{source}.yaml")

"""Many numbers of a policy with many patients, as one compiled batch of worlds; for policies over arrays only."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from dms_core.files.json_text import finite
from exo_env.patient.population import Source, population

from ...environment import make_vector
from ...policies.batch_policy import BatchPolicy


def batch_returns(
    kind: type[BatchPolicy],
    rows: Sequence[Mapping[str, float]],
    seeds: Sequence[int],
    patients_of: Source,
    environment: str,
    settings: Mapping[str, Any],
) -> tuple[np.ndarray, np.ndarray]:
    """Return of each episode, and whether an event ended it; shape (rows, seeds) each.

    Args:
        kind: of policy.
        rows: its numbers.
        seeds: of the episodes, the same for all rows.
        patients_of: population by name or YAML file.
        environment: its id.
        settings: further ones of the environment.
    """
    returns, unsafe = (np.zeros((len(rows), len(seeds)), x) for x in (float, bool))
    for rewards, ended in batch_steps(kind, rows, seeds, patients_of, environment, settings):
        returns += rewards
        unsafe |= ended
    return returns, unsafe


def batch_steps(
    kind: type[BatchPolicy],
    rows: Sequence[Mapping[str, float]],
    seeds: Sequence[int],
    patients_of: Source,
    environment: str,
    settings: Mapping[str, Any],
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The steps of the episodes of `batch_returns`.

    Yields:
        Reward of each episode, 0 where it is over, and whether an event ends it now; shape (rows, seeds) each.
    """
    tries, patients = len(rows), len(seeds)
    worlds = _worlds(
        environment, tries * patients, kind.action_mode, kind.observation,
        json.dumps(population(patients_of).model_dump()), json.dumps(finite(dict(settings))),
    )  # fmt: skip
    acting = kind(**{name: np.repeat([float(row[name]) for row in rows], patients) for name in kind.ranges})
    observations, _ = worlds.reset(seed=[*seeds] * tries)
    acting.begin(worlds, worlds.num_envs)
    running = np.ones(worlds.num_envs, dtype=bool)
    while running.any():
        observations, rewards, terminated, truncated, _ = worlds.step(acting.act(observations))
        now, ended = np.where(running, rewards, 0.0), running & terminated
        yield now.reshape(tries, patients), ended.reshape(tries, patients)
        running &= ~(terminated | truncated)


@lru_cache(maxsize=1)
def _worlds(environment: str, count: int, mode: str, observation: tuple[str, ...], patient: str, settings: str) -> Any:
    """The worlds of the last batch, if they can be used again: to make them takes as long as some of their episodes."""
    return make_vector(
        environment, count, threads=1, action_mode=mode, observation=list(observation), patient=json.loads(patient),
        **json.loads(settings),
    )  # fmt: skip

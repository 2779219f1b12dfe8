"""Episodes of exo/HiddenIntent-v0 with everything written down: all channels, the plan, and what muscles are told.

They run in one compiled batch of worlds, an equal part of it driven by each of several policies, whose moments are
disturbed smoothly, so that an estimator meets devices that help much, little, and wrongly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np

from agents.environment import HIDDEN_PLAN, make_vector
from agents.policies.policy import Channels
from agents.training.wrappers.teacher import Teacher
from dms_core.model.muscles.activation import MINIMUM
from exo_env.patient.excitation.slacking import MOST_EFFORT

GROUPS = ("device", "estimated", "emg", "privileged")
SETTINGS = {"action_mode": "assist_moment", "observation": list(GROUPS)}
NOBODY = "nobody"
"""The driver that commands no moment and no co-tension."""
EVERY = 2
"""Control periods from one written row to the next: 25 Hz."""
AHEAD = (0.1, 0.2, 0.3, 0.4)
"""Times ahead at which the plan is written down [s]; those of the environment's preview are among them."""
TARGETS = ("intent", "intent_rate", *(f"intent in {t} s" for t in AHEAD))
"""Columns of the plan [rad, rad/s]."""
SILENT = MOST_EFFORT * MINIMUM
"""Wanted activation up to which a muscle is wanted for nothing [-]."""
WANDERING = 0.5
"""Correlation time of the disturbance [s]."""


class Acting(Protocol):
    """What can drive a part of a batch."""

    def begin(self, worlds: int, /) -> None:
        """Begin an episode in each of its worlds."""

    def act(self, observations: np.ndarray, /) -> np.ndarray:
        """Actions (n, 2) for the observations (n, k) of its worlds."""


Driver = str | Acting
"""Name of a policy, or one itself."""


@dataclass(frozen=True)
class Episodes:
    """Rows of n episodes at T times."""

    seen: np.ndarray
    """Observation with all groups, shape (n, T, k)."""
    plan: np.ndarray
    """At the columns of TARGETS, shape (n, T, 6)."""
    wanted: np.ndarray
    """Activation of each muscle that is wanted before its ceiling [-], co-contraction included, shape (n, T, m)."""
    full: np.ndarray
    """Whether a muscle is told all that weakness and fatigue leave of it, shape (n, T, m)."""
    steady: np.ndarray
    """Whether what it is told stays the same if a little more or less is wanted, shape (n, T, m)."""
    running: np.ndarray
    """Whether the episode goes on, shape (n, T)."""
    returns: np.ndarray
    """Shape (n,)."""

    def and_also(self, other: Episodes) -> Episodes:
        """These and others."""
        names = [f.name for f in fields(self)]
        return Episodes(**{x: np.concatenate([getattr(self, x), getattr(other, x)]) for x in names})


class _Nobody:
    """No moment and no co-tension."""

    def begin(self, worlds: int) -> None:
        """There is nothing to begin."""

    def act(self, observations: np.ndarray) -> np.ndarray:
        return np.tile([0.0, -1.0], (len(observations), 1))


class Mixture:
    """Policies that drive equal parts of a batch.

    Args:
        drivers: one for each part.
        settings: of the environment.
    """

    def __init__(self, drivers: Sequence[Driver], settings: dict[str, Any]) -> None:
        self._parts = [
            _Nobody() if x == NOBODY else Teacher(x, HIDDEN_PLAN, settings) if isinstance(x, str) else x
            for x in drivers
        ]

    def begin(self, worlds: int) -> None:
        """Begin an episode in each world."""
        self._rows = np.array_split(np.arange(worlds), len(self._parts))
        for part, rows in zip(self._parts, self._rows, strict=True):
            part.begin(len(rows))

    def act(self, observations: np.ndarray) -> np.ndarray:
        """Actions of all worlds, shape (n, 2)."""
        parts = zip(self._parts, self._rows, strict=True)
        return np.concatenate([part.act(observations[rows]) for part, rows in parts]).astype(float)


def record(
    population: str, seeds: Sequence[int], drivers: Sequence[Driver], worlds: int = 60, disturbance: float = 0.0,
    seed: int = 0,
) -> Episodes:  # fmt: skip
    """Run an episode with each seed.

    Args:
        population: of the patients.
        seeds: of the episodes.
        drivers: policies that share the worlds of a batch.
        worlds: of a batch at most.
        disturbance: largest standard deviation of what is added to the moment's action [-]; each episode has its own.
        seed: of the disturbance.
    """
    generator, rounds, found = np.random.default_rng(seed), -(-len(seeds) // worlds), None
    for part in np.array_split(np.asarray(seeds), rounds):
        settings = {**SETTINGS, "patient": population}
        batch = _worlds(len(part), population)
        one = _round(batch, part.tolist(), Mixture(drivers, settings), disturbance, generator)
        found = one if found is None else found.and_also(one)
    assert found is not None
    return found


_made: dict[tuple[int, str], Any] = {}


def _worlds(count: int, population: str) -> Any:
    """Worlds that are used again: to make them takes longer than their episodes."""
    if (count, population) not in _made:
        _made[count, population] = make_vector(HIDDEN_PLAN, count, threads=1, patient=population, **SETTINGS)
    return _made[count, population]


def _round(
    batch: Any, seeds: list[int], mixture: Mixture, disturbance: float, generator: np.random.Generator
) -> Episodes:
    """An episode in each world of a batch."""
    n, period, channels = batch.num_envs, batch.envs[0].period, Channels(batch)
    observations, _ = batch.reset(seed=seeds)
    mixture.begin(n)
    kept = math.exp(-period / WANDERING)
    size, pushed = generator.uniform(0.0, disturbance, n) if disturbance else np.zeros(n), np.zeros(n)
    running, returns, rows = np.ones(n, bool), np.zeros(n), []
    for k in range(batch.steps):
        if k % EVERY == 0:
            rows.append((observations, _plan(batch, k, period), *_told(batch, channels, observations), running.copy()))
        actions = mixture.act(observations)
        pushed = kept * pushed + math.sqrt(1.0 - kept**2) * size * generator.standard_normal(n)
        actions[:, 0] += pushed
        # Worlds whose episode is over begin another one, which is not looked at.
        observations, rewards, terminated, truncated, _ = batch.step(np.clip(actions, -1.0, 1.0))
        returns += np.where(running, rewards, 0.0)
        running &= ~(terminated | truncated)
    columns = [np.stack(column, axis=1) for column in zip(*rows, strict=True)]
    return Episodes(*(x.astype(np.float32) if x.dtype != bool else x for x in columns), returns)


def _plan(batch: Any, step: int, period: float) -> np.ndarray:
    """The plan at a step, shape (n, 6); behind the end of an episode it stays where it is."""
    courses = [env.world.tables.plan.course for env in batch.envs]
    late = [min(step + round(t / period), len(courses[0]) - 1) for t in AHEAD]
    return np.array([[*c[step, :2], *c[late, 0]] for c in courses])


def _told(batch: Any, channels: Channels, observations: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What each muscle is wanted to do, and whether it is told all it can, or stays as it is, shape (n, m) each."""
    efforts = [env.world.tables.patient.effort for env in batch.envs]
    intents, flexes = np.array([e.intents[1] for e in efforts]), efforts[0].sign > 0.0
    read = {x: channels.columns(observations, f"privileged.{x}").T for x in (
        "maximum_activation_flexors", "maximum_activation_extensors", "co_contraction", "fatigued")}  # fmt: skip
    most = np.where(flexes, read["maximum_activation_flexors"], read["maximum_activation_extensors"])
    return limits_of(intents, most, read["co_contraction"], read["fatigued"], flexes)


def limits_of(
    intents: np.ndarray, most: np.ndarray, co_contraction: np.ndarray, fatigued: np.ndarray, flexes: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Wanted activation, whether a muscle is told all it can, and whether it stays as it is, shape (n, m) each.

    A muscle that is neither told all it can nor wanted by itself follows what co-contracts with it, if that moves. The
    equations are those of exo_env/patient/excitation/effort.py.
    """
    limited, own = np.minimum(intents, most), intents > SILENT
    wanted = intents + co_contraction * _of_others(limited, flexes)
    full = wanted >= most * (1.0 - fatigued) * (1.0 - 1e-3)
    follows = _of_others(own & (intents < most), flexes) * co_contraction > 0.0
    return wanted, full, full | ~(own | follows)


def _of_others(values: np.ndarray, flexes: np.ndarray) -> np.ndarray:
    """Mean over the muscles of the other group, shape (n, m)."""
    flexors, extensors = values[:, flexes].mean(axis=1), values[:, ~flexes].mean(axis=1)
    return np.where(flexes, extensors[:, None], flexors[:, None])

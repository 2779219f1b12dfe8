"""A long run of random actions over a population: what goes wrong, if anything does."""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium.envs.registration import load_env_creator

from exo_env.envs.base_env import AssistanceEnv
from exo_env.envs.lookup import spec_of
from exo_env.tables import STATUS
from exo_env.tasks.task import FIRST_EVENT, NOTHING, SOLVER

DEFAULT = "exo/ElbowLift-v2"


def soak(
    steps: int,
    *,
    env: str = DEFAULT,
    seed: int = 0,
    progress: Callable[[int], None] | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """Random actions, a new patient an episode.

    Args:
        steps: control periods in all.
        env: id of the environment.
        seed: seed of the environment and of the actions.
        progress: is called with the number of steps done.
        settings: settings of the environment; the observation has all groups unless they say otherwise.

    Returns:
        Counts of episodes, of what ended them and of failed solves, and the worst figures of all steps; fewer than
        `steps` of them where the user stopped it (Ctrl-C).

    Raises:
        InputError: there is no such environment, or it is none of AssistanceEnv.
    """
    world = _made(env, {"patient": "evaluation"} | settings)
    actions = np.random.default_rng(seed)
    found = _Found()
    world.reset(seed=seed)
    begin = time.perf_counter()
    with contextlib.suppress(KeyboardInterrupt):
        for _ in range(steps):
            before = time.perf_counter()
            action = actions.uniform(-1.0, 1.0, world.action_space.shape)
            observation, reward, terminated, truncated, info = world.step(action)
            took = 1e3 * (time.perf_counter() - before)
            usual = np.isfinite(reward) and np.isfinite(observation).all() and observation in world.observation_space
            found.add_step(took, bool(usual), info)
            if terminated or truncated or found.steps == steps:
                found.add_end(_end(world, truncated), world.readings())
                world.reset()
            if progress is not None:
                progress(found.steps)
    return found.summary(time.perf_counter() - begin)


@dataclass
class _Found:
    """What a run has found so far."""

    steps: int = 0
    bad: int = 0
    """Steps that gave a number which is not finite, or an observation outside of its space."""
    failures: list[str] = field(default_factory=list)
    """Sentences of failed solves."""
    ends: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0
    """Longest step [ms]."""
    phi: float = 0.0
    phi_v: float = 0.0
    drift: float = 0.0
    """Largest one [rad]."""

    def add_step(self, milliseconds: float, usual: bool, info: dict[str, Any]) -> None:
        """A step, and whether what it gave is finite and inside its space."""
        self.steps += 1
        self.slowest = max(self.slowest, milliseconds)
        self.bad += not usual
        if info["solver_failed"]:
            self.failures.append(info["event"])

    def add_end(self, why: str, readings: dict[str, float]) -> None:
        """The end of an episode."""
        self.ends[why] += 1
        self.phi = max(self.phi, readings["solver.largest_phi"])
        self.phi_v = max(self.phi_v, readings["solver.largest_phi_v"])
        self.drift = max(self.drift, abs(readings["tracking.drift"]))

    def summary(self, seconds: float) -> dict[str, Any]:
        """All of it, after a run of so many seconds."""
        return {
            "steps": self.steps, "episodes": sum(self.ends.values()), "ends": dict(self.ends),
            "not_finite_or_outside": self.bad, "failed_solves": len(self.failures), "failures": self.failures,
            "largest_phi": self.phi, "largest_phi_v": self.phi_v, "largest_drift_rad": self.drift,
            "slowest_step_ms": self.slowest, "steps_per_second": self.steps / seconds,
        }  # fmt: skip


def _made(name: str, settings: dict[str, Any]) -> AssistanceEnv:
    """The environment of an id, with all groups of observations.

    Raises:
        InputError: there is no such environment, or it is none of AssistanceEnv.
    """
    spec = spec_of(name)
    maker: Any = load_env_creator(spec.entry_point) if isinstance(spec.entry_point, str) else spec.entry_point
    fixed = {**spec.kwargs, **settings}
    groups = list(maker(**fixed).task.groups)
    return maker(**{"observation": groups, **fixed})


def _end(env: AssistanceEnv, truncated: bool) -> str:
    """Why an episode ended: an event by its name, time, or the end of the run."""
    code = int(env.world.tables.status[STATUS.event])
    if code == SOLVER:
        return "solver"
    if code != NOTHING:
        return env.task.events[code - FIRST_EVENT]
    return "time" if truncated else "end of the soak"

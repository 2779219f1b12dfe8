"""A long run of random actions over a population: what goes wrong, if anything does."""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Callable
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
    ends: Counter[str] = Counter()
    failures: list[str] = []
    bad, worst = 0, {"phi": 0.0, "phi_v": 0.0, "drift_rad": 0.0, "step_ms": 0.0}
    observation, _ = world.reset(seed=seed)
    begin, done = time.perf_counter(), 0
    with contextlib.suppress(KeyboardInterrupt):
        for k in range(steps):
            before = time.perf_counter()
            action = actions.uniform(-1.0, 1.0, world.action_space.shape)
            observation, reward, terminated, truncated, info = world.step(action)
            worst["step_ms"] = max(worst["step_ms"], 1e3 * (time.perf_counter() - before))
            bad += not (
                np.isfinite(observation).all() and np.isfinite(reward) and observation in world.observation_space
            )
            done = k + 1
            if info["solver_failed"]:
                failures.append(info["event"])
            if terminated or truncated or done == steps:
                ends[_end(world, truncated)] += 1
                r = world.readings()
                worst["phi"] = max(worst["phi"], r["solver.largest_phi"])
                worst["phi_v"] = max(worst["phi_v"], r["solver.largest_phi_v"])
                worst["drift_rad"] = max(worst["drift_rad"], abs(r["tracking.drift"]))
                observation, _ = world.reset()
            if progress is not None:
                progress(done)
    return {
        "steps": done, "episodes": sum(ends.values()), "ends": dict(ends), "not_finite_or_outside": bad,
        "failed_solves": len(failures), "failures": failures, "largest_phi": worst["phi"],
        "largest_phi_v": worst["phi_v"], "largest_drift_rad": worst["drift_rad"],
        "slowest_step_ms": worst["step_ms"], "steps_per_second": done / (time.perf_counter() - begin),
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

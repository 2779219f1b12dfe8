"""A long run of random actions over a population: what goes wrong, if anything does."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from exo_env.envs.elbow_lift import ElbowLiftEnv


def soak(
    steps: int,
    *,
    seed: int = 0,
    progress: Callable[[int], None] | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """Random actions, a new patient an episode.

    Args:
        steps: control periods in all.
        seed: of the environment and of the actions.
        progress: called with the number of steps done.
        settings: of the environment; the observation has all groups.

    Returns:
        Counts of episodes, of what ended them and of failed solves, and the worst figures of all steps.
    """
    env = ElbowLiftEnv(**({"patient": "evaluation", "observation": ["device", "emg", "privileged"]} | settings))
    actions = np.random.default_rng(seed)
    ends: Counter[str] = Counter()
    failures: list[str] = []
    bad, worst = 0, {"phi": 0.0, "phi_v": 0.0, "drift_rad": 0.0, "step_ms": 0.0}
    observation, _ = env.reset(seed=seed)
    begin = time.perf_counter()
    for k in range(steps):
        before = time.perf_counter()
        observation, reward, terminated, truncated, info = env.step(actions.uniform(-1.0, 1.0, env.action_space.shape))
        worst["step_ms"] = max(worst["step_ms"], 1e3 * (time.perf_counter() - before))
        bad += not (np.isfinite(observation).all() and np.isfinite(reward) and observation in env.observation_space)
        if info["solver_failed"]:
            failures.append(info["event"])
        if terminated or truncated or k == steps - 1:
            ends[_kind(info, truncated)] += 1
            r = env.readings()
            worst["phi"] = max(worst["phi"], r["solver.largest_phi"])
            worst["phi_v"] = max(worst["phi_v"], r["solver.largest_phi_v"])
            worst["drift_rad"] = max(worst["drift_rad"], abs(r["tracking.drift"]))
            observation, _ = env.reset()
        if progress is not None:
            progress(k + 1)
    return {
        "steps": steps, "episodes": sum(ends.values()), "ends": dict(ends), "not_finite_or_outside": bad,
        "failed_solves": len(failures), "failures": failures, "largest_phi": worst["phi"],
        "largest_phi_v": worst["phi_v"], "largest_drift_rad": worst["drift_rad"],
        "slowest_step_ms": worst["step_ms"], "steps_per_second": steps / (time.perf_counter() - begin),
    }  # fmt: skip


def _kind(info: dict[str, Any], truncated: bool) -> str:
    """Why an episode ended."""
    sentence = info.get("event")
    if sentence is None:
        return "time" if truncated else "end of the soak"
    if info["solver_failed"]:
        return "solver"
    return next((kind for kind in ("reaction", "rope") if kind in sentence), "angle")

"""Vector environments give what single environments of the same seeds give, across the ends of episodes."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv, VectorEnv

from exo_env.envs.elbow_lift import ElbowLiftVectorEnv

ID, SETTINGS = "exo_env:exo/ElbowLift-v2", {"episode_duration": 0.1, "observation": ["device", "emg"]}
SEEDS, STEPS = [4, 5], 12
ACTIONS = np.random.default_rng(0).uniform(-1.0, 1.0, (STEPS, len(SEEDS), 2)).astype(np.float32)


def _environment() -> gymnasium.Env:
    """Episodes of five periods; the module in the id is imported where the environment is made."""
    return gymnasium.make(ID, **SETTINGS)


VECTORS = {
    "sync": lambda: SyncVectorEnv([_environment] * len(SEEDS)),
    "async": lambda: AsyncVectorEnv([_environment] * len(SEEDS)),
    # A new process imports everything anew, as on macOS and Windows.
    "async, spawned": lambda: AsyncVectorEnv([_environment] * len(SEEDS), context="spawn"),
    "make_vec": lambda: gymnasium.make_vec(ID, num_envs=len(SEEDS), vectorization_mode="async", **SETTINGS),
}


def _alone(place: int) -> list[tuple]:
    """(observation, reward, terminated, truncated, tracking error) of each step of one environment.

    The step behind the end of an episode is its reset, as in a vector environment.
    """
    env = _environment()
    observation, _ = env.reset(seed=SEEDS[place])
    found, over = [(observation, 0.0, False, False, 0.0)], False
    for action in ACTIONS[:, place]:
        if over:
            observation, _ = env.reset()
            found.append((observation, 0.0, False, False, 0.0))
            over = False
            continue
        observation, reward, terminated, truncated, info = env.step(action)
        found.append((observation, reward, terminated, truncated, info["tracking_error_deg"]))
        over = terminated or truncated
    return found


def _together(envs: VectorEnv) -> list[list[tuple]]:
    """The same of a vector of environments, by place."""
    observations, _ = envs.reset(seed=SEEDS)
    found = [[(o, 0.0, False, False, 0.0)] for o in observations]
    for actions in ACTIONS:
        observations, rewards, terminated, truncated, info = envs.step(actions)
        errors = info.get("tracking_error_deg", np.zeros(len(SEEDS)))
        for row, *step in zip(found, observations, rewards, terminated, truncated, errors, strict=True):
            row.append(tuple(step))
    return found


KINDS = [pytest.param(k, marks=pytest.mark.slow) if "spawned" in k else k for k in VECTORS]
"""A process that is spawned imports everything anew."""


@pytest.mark.parametrize("kind", KINDS)
def test_a_vector_gives_what_its_environments_give_alone(kind):
    envs = VECTORS[kind]()
    try:
        together = _together(envs)
    finally:
        envs.close()
    for place, steps in enumerate(together):
        alone = _alone(place)
        assert [bool(s[3]) for s in steps].count(True) == 2, "the run crosses the ends of two episodes"
        for step, wanted in zip(steps, alone, strict=True):
            np.testing.assert_array_equal(step[0], wanted[0])
            assert step[1:] == wanted[1:]


@pytest.mark.parametrize(("steps", "ends"), [(4, 4), (100, 10), (-1, 10), (None, 10)])
def test_gymnasium_may_give_a_largest_number_of_steps(steps, ends):
    worlds = gymnasium.make_vec("exo/ElbowLift-v2", num_envs=2, episode_duration=0.2, max_episode_steps=steps)
    try:
        worlds.reset(seed=0)
        truncated = [worlds.step(np.zeros((2, 2)))[3].tolist() for _ in range(ends)]
        assert truncated == [[False, False]] * (ends - 1) + [[True, True]]
    finally:
        worlds.close()


def test_actions_may_lie_in_any_order_in_memory():
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 2))
    orders = (actions, np.asfortranarray(actions), np.repeat(actions, 2, axis=1)[:, ::2])
    results = []
    for order in orders:
        worlds = ElbowLiftVectorEnv(3)
        try:
            worlds.reset(seed=0)
            results.append(worlds.step(order)[0])
        finally:
            worlds.close()
    assert all(np.array_equal(results[0], x) for x in results[1:])

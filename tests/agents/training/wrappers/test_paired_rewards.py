"""Worlds and their twins: rewards of training as differences to the same patient under a constant action."""

import numpy as np
import pytest

from agents.environment import ENVIRONMENT, make, make_vector
from agents.training.settings.config import Config
from agents.training.worlds import training_worlds
from dms_core.errors import InputError
from tests.agents.tiny import content

pytest.importorskip("stable_baselines3")

PIDS = {"patient": "mixed", "action_mode": "pid_setpoint", "episode_duration": 0.3}
STEPS, WORLDS = 40, 3
"""Beyond two ends of an episode."""


def test_the_twins_action_earns_nothing_in_any_episode():
    worlds = training_worlds(PIDS, WORLDS, 7, against=(0.1, 0.6))
    worlds.reset()
    ends = 0
    for _ in range(STEPS):
        _, rewards, over, _ = worlds.step(np.tile([0.1, 0.6], (WORLDS, 1)))
        assert rewards.tolist() == [0.0] * WORLDS
        ends += over.sum()
    assert ends == 2 * WORLDS
    worlds.close()


def test_a_reward_is_that_of_the_world_less_that_of_its_twin():
    action, against = (-0.3, 0.9), (0.1, 0.6)
    worlds = training_worlds(PIDS, WORLDS, 7, against=against)
    alone = make_vector(ENVIRONMENT, 2 * WORLDS, autoreset_mode="SameStep", **PIDS)
    first = worlds.reset()
    begun, _ = alone.reset(seed=[7, 8, 9, 7, 8, 9])
    np.testing.assert_array_equal(first, begun[:WORLDS])
    given = np.repeat([action, against], WORLDS, axis=0)
    for _ in range(STEPS):
        seen, rewards, over, _ = worlds.step(np.tile(action, (WORLDS, 1)))
        if over.any():
            # Patient, load, movement and start.
            twins = worlds.unwrapped.env_method("start_info", indices=range(WORLDS, 2 * WORLDS))
            assert worlds.env_method("start_info") == twins
        there, parts, *_ = alone.step(given)
        np.testing.assert_array_equal(seen, there[:WORLDS])
        single = parts.astype(np.float32)
        np.testing.assert_array_equal(rewards, single[:WORLDS] - single[WORLDS:])
    worlds.close()
    alone.close()


@pytest.mark.parametrize("dropped", ["world", "twin"])
def test_a_pair_that_fell_out_of_step_begins_together_again(dropped):
    # A patient who can do nothing, without tension: the arm falls and the episode ends early.
    settings = {
        "patient": {"maximum_activation_flexors": 0.05, "maximum_activation_extensors": 0.05},
        "limits": {"lowest_deg": 15.0}, "episode_duration": 2.0,
    }  # fmt: skip
    falls, held = (-1.0, -1.0), (-0.6, -1.0)
    action, against = (falls, held) if dropped == "world" else (held, falls)
    worlds, single = training_worlds(settings, 1, 3, against=against), make(ENVIRONMENT, **settings)
    worlds.reset()
    single.reset(seed=3)
    times, alone = [], 0.0
    for _ in range(2):
        over, count = np.zeros(1, bool), 0
        while not over[0]:
            seen, rewards, over, _ = worlds.step(np.array([action]))
            if not times:
                alone = single.step(np.array(action))[1]
            count += 1
        if dropped == "twin" and not times:
            # The twin's world has begun other episodes on the way, which count for nothing.
            assert rewards[0] == np.float32(alone)
        times.append(count)
    assert max(times) < 50 if dropped == "world" else times == [100, 100]
    assert worlds.env_method("start_info") == worlds.unwrapped.env_method("start_info", indices=1)
    assert seen.shape == (1, worlds.observation_space.shape[0])
    worlds.close()


def test_an_action_that_cannot_be_is_refused():
    for key in ("against", "start"):
        with pytest.raises(InputError, match=key):
            Config.of(content(training={key: [0.0, 1.5]}), "ppo")

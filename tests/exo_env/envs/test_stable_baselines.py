"""Stable-Baselines3 takes the environment as it is: its checker is silent, and its vectors and PPO run on it."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.envs.elbow_lift import ElbowLiftEnv


@pytest.mark.parametrize("mode", list(ElbowLiftEnv.drives))
@pytest.mark.parametrize("groups", [["device"], ["privileged", "emg", "device"]])
def test_checker_finds_nothing(make, mode, groups):
    from stable_baselines3.common.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(action_mode=mode, observation=groups))


def test_ppo_learns_across_the_ends_of_episodes(make):
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_util import make_vec_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        envs = make_vec_env(lambda: make(episode_duration=0.2), n_envs=2, seed=0)
        try:
            policy = PPO("MlpPolicy", envs, n_steps=16, batch_size=16, n_epochs=1, seed=0, device="cpu")
            before = [p.detach().clone() for p in policy.policy.parameters()]
            policy.learn(32)
            assert any((a != b).any() for a, b in zip(before, policy.policy.parameters(), strict=True))
            # The Monitor of each environment has seen whole episodes of 10 periods.
            assert policy.ep_info_buffer and {e["l"] for e in policy.ep_info_buffer} == {10}
            action, _ = policy.predict(envs.reset(), deterministic=True)
            assert action.shape == (2, 2) and np.isfinite(action).all()
        finally:
            envs.close()


@pytest.fixture(scope="module")
def worlds():
    """Two worlds of ten periods as a VecEnv."""
    from exo_env.envs.elbow_lift_sb3 import ElbowLiftVecEnv

    worlds = ElbowLiftVecEnv(num_envs=2, episode_duration=0.2)
    yield worlds
    worlds.close()


def loads(worlds):
    """The load of each world [kg]."""
    return [env.episode.load for env in worlds.worlds.envs]


def test_options_hold_for_the_next_reset_only(worlds):
    worlds.seed(0)
    worlds.set_options({"load": 1.25})
    worlds.reset()
    assert loads(worlds) == [1.25, 1.25] == [info["load"] for info in worlds.reset_infos]
    worlds.reset()
    assert 1.25 not in loads(worlds)


def test_reset_options_hold_behind_the_end_of_an_episode(worlds):
    worlds.seed(0)
    worlds.env_method("set_reset_options", {"load": 0.75}, indices=1)
    try:
        worlds.reset()
        for _ in range(2):
            drawn, given = loads(worlds)
            assert given == 0.75 != drawn
            for _ in range(10):
                _, _, over, _ = worlds.step(np.zeros((2, 2), np.float32))
            assert over.all() and [info["load"] for info in worlds.reset_infos] == loads(worlds)
    finally:
        worlds.env_method("set_reset_options", None)


@pytest.mark.parametrize("name", ["observation", "patient", "drive", "ecosystem"])
def test_what_a_world_was_made_with_cannot_be_set(worlds, name):
    with pytest.raises(InputError, match=f"'{name}' cannot be set.*the environments were made with it"):
        worlds.set_attr(name, None)
    assert all(getattr(env, name, env) is not None for env in worlds.worlds.envs)


def test_an_attribute_of_its_own_can_be_set(worlds):
    worlds.set_attr("note", "left", indices=0)
    assert worlds.get_attr("note", indices=0) == ["left"] and not hasattr(worlds.worlds.envs[1], "note")

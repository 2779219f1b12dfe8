"""Stable-Baselines3 takes the environment as it is: its checker is silent, and its vectors and PPO run on it."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

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

"""RLlib, which wants a Gymnasium of its own: `make test-rllib` installs both beside the project and runs this."""

import pytest

pytest.importorskip("ray.rllib")

from ray.rllib.algorithms.ppo import PPOConfig

from agents.distributed.rllib import register


def test_rllib_trains_on_the_environment_it_was_told_of():
    task = {"patient": "stroke_mild", "episode_duration": 1.0}
    config = PPOConfig().environment(register(), env_config=task).env_runners(num_env_runners=0)
    algorithm = config.training(train_batch_size_per_learner=100, minibatch_size=50, num_epochs=1).build_algo()
    try:
        told = algorithm.train()["env_runners"]
    finally:
        algorithm.stop()
    # Two episodes of fifty control periods.
    assert told["num_env_steps_sampled"] == 100
    assert -300.0 < told["episode_return_mean"] < 100.0

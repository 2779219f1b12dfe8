"""Trainings of a few seconds, for tests."""

from pathlib import Path

import yaml

from agents.environment import ENVIRONMENT

ENV_KWARGS = {"patient": "stroke_mild", "episode_duration": 0.4}
TRAINING = {"eval_every": 64, "eval_patients": 1, "save_every": 32}
ON_POLICY = {"n_envs": 2, "n_timesteps": 128, "n_steps": 16, "batch_size": 32, "n_epochs": 2, "gamma": 0.98}
OFF_POLICY = {
    "n_envs": 2, "n_timesteps": 96, "learning_starts": 20, "batch_size": 16, "buffer_size": 200, "train_freq": 1,
    "gradient_steps": 1,
}  # fmt: skip
SECTIONS = {
    "ppo": {**ON_POLICY, "normalize": True, "learning_rate": "lin_1e-3", "policy": "MlpPolicy",
            "policy_kwargs": "dict(net_arch=dict(pi=[16, 8], vf=[8]), activation_fn=nn.Tanh)"},
    "sac": {**OFF_POLICY, "normalize": "dict(norm_obs=True, norm_reward=False)", "frame_stack": 3,
            "policy_kwargs": {"net_arch": [16, 8], "activation_fn": "elu"}},
    "tqc": {**OFF_POLICY, "policy_kwargs": "dict(net_arch=[16], n_critics=1)"},
    "recurrent_ppo": {**ON_POLICY, "normalize": True, "policy": "MlpLstmPolicy",
                      "policy_kwargs": "dict(net_arch=dict(pi=[8], vf=[8]), lstm_hidden_size=6, n_lstm_layers=2)"},
    "dagger": {"n_envs": 2, "n_timesteps": 120, "batch_size": 20, "n_epochs": 2, "normalize": True,
               "policy": "MlpLstmPolicy",
               "policy_kwargs": "dict(net_arch=dict(pi=[8], vf=[8]), lstm_hidden_size=6, n_lstm_layers=2)"},
}  # fmt: skip
OF_ALGORITHM = {"dagger": {"imitation": {"teacher": "none", "driven": 80, "kept": 2, "segment": 8}}}
"""What the section `training` has of an algorithm alone; a round has 2 times 20 steps."""


def content(algorithm="ppo", training=None, **changes):
    """Content of a configuration file."""
    section = {**SECTIONS[algorithm], "env_kwargs": dict(ENV_KWARGS), **changes}
    own = {"algorithm": algorithm, **TRAINING, **OF_ALGORITHM.get(algorithm, {}), **(training or {})}
    return {ENVIRONMENT: section, "training": own}


def config_file(folder: Path, algorithm="ppo", training=None, **changes) -> Path:
    """A configuration file of a training of a few seconds."""
    path = folder / f"{algorithm}.yml"
    path.write_text(yaml.safe_dump(content(algorithm, training, **changes), sort_keys=False))
    return path

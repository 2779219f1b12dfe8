"""From a model of Stable-Baselines3 to the numbers of a policy: the networks that act, not those that only judge."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from dms_core.errors import InputError

from ...policies.learned import Description, LearnedPolicy, world_facts
from ...policies.network import Architecture
from ...provenance import package_version
from ..learners.algorithms import ACTIVATIONS
from ..wrappers.low_pass import kept_shares

CELL = {"input": "weight_ih", "state": "weight_hh", "input_bias": "bias_ih", "state_bias": "bias_hh"}
"""Arrays of an LSTM cell by their names, and what PyTorch calls them."""


@dataclass(frozen=True)
class Origin:
    """What a model was trained with."""

    environment: str
    """Id of the environment."""
    algorithm: str
    """Name of the algorithm."""
    seed: int | None = None
    """Seed of the training."""
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    """Settings of the training environment."""
    low_pass_times: tuple[float, ...] = ()
    """Time constants of filtered observations [s]."""
    action_repeat: int = 1
    """Control periods that an action is held."""

    @property
    def title(self) -> str:
        """In tables."""
        name = self.algorithm.upper().replace("_", " ")
        return name if self.seed is None else f"{name}, seed {self.seed}"


def extract(
    model: BaseAlgorithm, env: gymnasium.Env, origin: Origin, normalisation: VecNormalize | None = None
) -> LearnedPolicy:
    """The policy of a model.

    Args:
        model: PPO, SAC, TQC or RecurrentPPO on vectors.
        env: one environment of its kind, unstacked.
        origin: what it was trained with.
        normalisation: of its observations; of the model's own worlds where it is not given.

    Raises:
        InputError: the model's policy has parts that cannot be written down.
    """
    statistics: Any = normalisation or (model.get_vec_normalize_env() if model.get_env() is not None else None)
    arrays = {name: one.detach().cpu().numpy().copy() for name, one in actor_parameters(model).items()}
    if statistics is not None and statistics.norm_obs:
        seen = getattr(model.policy, "seen", slice(None))
        arrays |= {"mean": statistics.obs_rms.mean[seen].copy(), "variance": statistics.obs_rms.var[seen].copy()}
    output = "tanh" if _squashed(model) else "clip"
    description = Description(
        title=origin.title, algorithm=origin.algorithm, environment=origin.environment, exo_env=package_version(),
        env_kwargs=origin.env_kwargs, architecture=_architecture(model, arrays, output, env, statistics, origin),
        steps=model.num_timesteps, seed=origin.seed, **world_facts(env),
    )  # fmt: skip
    return LearnedPolicy(description, arrays)


def _architecture(
    model: BaseAlgorithm, arrays: dict[str, np.ndarray], output: str, env: gymnasium.Env, statistics: Any,
    origin: Origin,
) -> Architecture:  # fmt: skip
    """Shape of the network."""
    world: Any = env.unwrapped
    kept = kept_shares(origin.low_pass_times, origin.action_repeat * world.period)
    spaces: Any = (model.observation_space, env.observation_space)
    inputs, single = (space.shape[0] for space in spaces)
    inputs = len(getattr(model.policy, "seen", range(inputs)))
    single *= 1 + len(kept)
    if inputs % single:
        raise InputError(f"the model sees {inputs} numbers; the environment shows {single}.")
    biases = [arrays[f"layer.{k}.bias"].size for k in range(sum(name.endswith(".bias") for name in arrays))]
    cells = sum(name.endswith(".state") for name in arrays)
    normalised = "mean" in arrays
    return Architecture(
        inputs=inputs, n_stack=inputs // single, traces=kept, hold=origin.action_repeat,
        hidden=tuple(biases[:-1]), outputs=biases[-1],
        activation=_activation(model), lstm_layers=cells,
        lstm_width=arrays["lstm.0.state"].shape[1] if cells else 0, output="tanh" if output == "tanh" else "clip",
        normalised=normalised,
        **({"clip": float(statistics.clip_obs), "epsilon": float(statistics.epsilon)} if normalised else {}),
    )  # fmt: skip


def actor_parameters(model: BaseAlgorithm) -> dict[str, torch.Tensor]:
    """Parameters of the networks that act, by the names of the exported arrays: layers in order, then LSTM cells.

    Raises:
        InputError: the model's policy has parts that cannot be written down.
    """
    policy: Any = model.policy
    squashed = _squashed(model)
    parts = (
        [*policy.actor.latent_pi, policy.actor.mu]
        if squashed
        else [*policy.mlp_extractor.policy_net, policy.action_net]
    )
    known: Any = (nn.Linear, *ACTIVATIONS.values())
    if not all(isinstance(p, known) for p in parts) or getattr(policy, "squash_output", False) != squashed:
        raise InputError(
            f"the {type(policy).__name__} of this model has parts that the exported form does not describe."
        )
    found: dict[str, torch.Tensor] = {}
    for k, layer in enumerate(p for p in parts if isinstance(p, nn.Linear)):
        found |= {f"layer.{k}.weight": layer.weight, f"layer.{k}.bias": layer.bias}
    lstm = getattr(policy, "lstm_actor", None)
    for k in range(lstm.num_layers if lstm is not None else 0):
        for name, theirs in CELL.items():
            found[f"lstm.{k}.{name}"] = getattr(lstm, f"{theirs}_l{k}")
    return found


def _squashed(model: BaseAlgorithm) -> bool:
    """Whether actions are the tanh of what the last layer says."""
    return getattr(model.policy, "actor", None) is not None


def _activation(model: BaseAlgorithm) -> str:
    """Name of the activation between the layers."""
    policy: Any = model.policy
    for name, kind in ACTIVATIONS.items():
        if policy.activation_fn is kind:
            return name
    raise InputError(f"activation {policy.activation_fn.__name__} is not one of {', '.join(ACTIVATIONS)}.")

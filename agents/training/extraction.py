"""From a model of Stable-Baselines3 to the numbers of a policy: the networks that act, not those that only judge."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from dms_core.errors import InputError

from ..policies.learned import Description, LearnedPolicy, world_facts
from ..policies.network import Architecture
from ..provenance import package_version
from .algorithms import ACTIVATIONS
from .wrappers.low_pass import kept_shares


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
    layers, output = _layers(model)
    statistics: Any = normalisation or (model.get_vec_normalize_env() if model.get_env() is not None else None)
    arrays = layers | _cells(model)
    if statistics is not None and statistics.norm_obs:
        seen = getattr(model.policy, "seen", slice(None))
        arrays |= {"mean": statistics.obs_rms.mean[seen].copy(), "variance": statistics.obs_rms.var[seen].copy()}
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


def _layers(model: BaseAlgorithm) -> tuple[dict[str, np.ndarray], str]:
    """Linear layers in order, and how their output becomes an action."""
    policy: Any = model.policy
    if hasattr(policy, "actor") and policy.actor is not None:
        parts, output = [*policy.actor.latent_pi, policy.actor.mu], "tanh"
    else:
        parts, output = [*policy.mlp_extractor.policy_net, policy.action_net], "clip"
    linear = [p for p in parts if isinstance(p, nn.Linear)]
    known: Any = (nn.Linear, *ACTIVATIONS.values())
    if not all(isinstance(p, known) for p in parts) or getattr(policy, "squash_output", False) != (output == "tanh"):
        raise InputError(
            f"the {type(policy).__name__} of this model has parts that the exported form does not describe."
        )
    arrays = {}
    for k, layer in enumerate(linear):
        arrays[f"layer.{k}.weight"], arrays[f"layer.{k}.bias"] = _array(layer.weight), _array(layer.bias)
    return arrays, output


def _cells(model: BaseAlgorithm) -> dict[str, np.ndarray]:
    """LSTM cells of the actor."""
    lstm = getattr(model.policy, "lstm_actor", None)
    arrays: dict[str, np.ndarray] = {}
    for k in range(lstm.num_layers if lstm is not None else 0):
        arrays[f"lstm.{k}.input"] = _array(getattr(lstm, f"weight_ih_l{k}"))
        arrays[f"lstm.{k}.state"] = _array(getattr(lstm, f"weight_hh_l{k}"))
        arrays[f"lstm.{k}.input_bias"] = _array(getattr(lstm, f"bias_ih_l{k}"))
        arrays[f"lstm.{k}.state_bias"] = _array(getattr(lstm, f"bias_hh_l{k}"))
    return arrays


def _activation(model: BaseAlgorithm) -> str:
    """Name of the activation between the layers."""
    policy: Any = model.policy
    for name, kind in ACTIVATIONS.items():
        if policy.activation_fn is kind:
            return name
    raise InputError(f"activation {policy.activation_fn.__name__} is not one of {', '.join(ACTIVATIONS)}.")


def _array(parameter: Any) -> np.ndarray:
    return parameter.detach().cpu().numpy().copy()

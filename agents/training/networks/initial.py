"""A training that begins with the networks of a trained policy, the inverse of extraction.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from dms_core.errors import InputError
from dms_core.files.json_text import brief
from dms_core.validation import shown

from ...checkpoint import Store
from ...policies.learned import LearnedPolicy, find_policy
from ...policies.policy import Policy
from .extraction import Origin, actor_parameters, extract


def initial_policy(name: str) -> Policy:
    """The policy that a training begins with.

    Args:
        name: as `find_policy` takes it; the folder of a training means its newest policy, not the one of the best
            return: a student becomes like its teacher, and its return may fall meanwhile.

    Raises:
        InputError: there is none.
    """
    folder = Path(name)
    if (folder / "run.json").is_file() and not Store(folder / "checkpoints").empty:
        return LearnedPolicy.load(Store(folder / "checkpoints").latest(), name)
    return find_policy(name)


def begin_with(model: BaseAlgorithm, name: str, env: gymnasium.Env, origin: Origin) -> None:
    """Give a fresh model the networks that act, and the statistics of observations, of a trained policy.

    Running statistics go on as if they had seen as much as the policy had in its training; what only a critic sees
    keeps the scales of its channels.

    Args:
        model: fresh.
        name: of the policy, as `initial_policy` takes it.
        env: one environment of the training.
        origin: what the model is trained with.

    Raises:
        InputError: the policy acts in another environment, or its networks have another shape.
    """
    try:
        policy = initial_policy(name)
        if not isinstance(policy, LearnedPolicy):
            raise InputError(f"policy '{name}' has no networks: expected a trained policy.")
        policy.reset(env)
        _check_shape(policy, extract(model, env, origin))
    except InputError as error:
        raise InputError(f"training.initial: {error}") from None
    with torch.no_grad():
        for array, parameter in actor_parameters(model).items():
            parameter.copy_(torch.as_tensor(policy.arrays[array]))
    statistics: Any = model.get_vec_normalize_env()
    if statistics is not None and policy.description.architecture.normalised:
        seen = getattr(model.policy, "seen", slice(None))
        known = statistics.obs_rms
        known.mean, known.var = np.zeros_like(known.mean), np.ones_like(known.var)
        known.mean[seen], known.var[seen] = policy.arrays["mean"], policy.arrays["variance"]
        known.count = float(max(policy.description.steps, 1))


def hold_actor(model: BaseAlgorithm, held: bool) -> None:
    """Let a policy's networks learn, or only its critic's."""
    for one in actor_parameters(model).values():
        one.requires_grad_(not held)
    noise = getattr(model.policy, "log_std", None)
    if isinstance(noise, torch.nn.Parameter):
        noise.requires_grad_(not held)


def _check_shape(policy: LearnedPolicy, fresh: LearnedPolicy) -> None:
    """Refuse a policy whose networks are not those of a fresh model."""
    known, expected = (one.description.architecture.model_dump() for one in (policy, fresh))
    different = [key for key in expected if known[key] != expected[key]]
    if different:
        said = ", ".join(f"{key} {shown(known[key])} in place of {shown(expected[key])}" for key in different)
        raise InputError(f"policy '{policy.name}' has other networks than this training: {brief(said)}.")

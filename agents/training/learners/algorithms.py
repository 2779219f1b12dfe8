"""The algorithms of Stable-Baselines3 and sb3-contrib: which there are, and what arguments each one takes.

Arguments are checked against the algorithm's own signature, so that a misspelt key or a text where a number belongs is
found before anything runs. What would need code in a configuration (classes, noise objects) cannot be given, nor
state-dependent exploration (use_sde) for algorithms whose policies it changes, so that the exported form no longer
describes them: of PPO it changes the noise only.
"""

from __future__ import annotations

import inspect
import math
import re
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Union, get_args, get_origin

import torch
from sb3_contrib import TQC, RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from dms_core.errors import InputError, choices
from dms_core.validation import cut, shown

from ..settings.config import OURS, Config, Training
from .critic import TwoViewLstmPolicy, TwoViewPolicy, seen_places
from .dagger import Dagger

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    "ppo": PPO, "sac": SAC, "tqc": TQC, "recurrent_ppo": RecurrentPPO, "dagger": Dagger,
}  # fmt: skip
ACTIVATIONS: dict[str, type[nn.Module]] = {
    "tanh": nn.Tanh, "relu": nn.ReLU, "elu": nn.ELU, "silu": nn.SiLU, "leakyrelu": nn.LeakyReLU,
}  # fmt: skip
NOT_GIVEN = (
    "self", "env", "policy", "tensorboard_log", "verbose", "seed", "device", "_init_setup_model", "action_noise",
    "optimize_memory_usage", "observation_space", "action_space", "lr_schedule", "full_std", "use_expln",
    "squash_output", "share_features_extractor", "normalize_images", "clip_mean", "use_sde_at_warmup",
    "rollout_buffer_kwargs", "replay_buffer_kwargs", "features_extractor_kwargs",
    "optimizer_kwargs", "lstm_kwargs", "imitation", "decisions",
)  # fmt: skip
TWO_VIEWS: dict[tuple[str, str, int], type] = {
    ("ppo", "MlpPolicy", 1): TwoViewPolicy, ("recurrent_ppo", "MlpLstmPolicy", 1): TwoViewLstmPolicy,
}  # fmt: skip
"""Policies whose critic sees more, by algorithm, policy and frame_stack."""
REWARDED = ("start", "against", "critic", "held")
"""Keys of `training` that do nothing where no reward is learned from."""
STATE_DEPENDENT = {"use_sde", "sde_sample_freq"}
SCHEDULE = re.compile(r"lin_(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
"""A value that falls linearly from this one to 0 at the end of the training."""
SQUASHED = ("sac", "tqc")
"""Those whose actions are the tanh of what their networks say."""
SMALL, NEARLY_ALL = 0.01, 0.99
"""Share that is left of the weights of an output layer, Stable-Baselines3's gain for those of PPO; and the largest
action at which a tanh is not yet so flat that nothing is learned."""
SHARES, POSITIVE = ("gamma", "gae_lambda"), ("learning_rate", "clip_range")
"""Arguments that lie from 0 to 1, and above 0."""
LARGEST, MOST, UNITS = 1e30, 10**9, (1, 10_000)
"""Size of a number, which PyTorch holds in 32 bits; most things; and how many units and parts a network may have."""
COUNTS = {
    "n_steps": (1, MOST), "batch_size": (1, MOST), "n_epochs": (1, MOST), "buffer_size": (1, MOST),
    "learning_starts": (0, MOST), "net_arch": UNITS, "lstm_hidden_size": UNITS, "n_lstm_layers": UNITS,
    "n_critics": UNITS, "n_quantiles": UNITS,
}  # fmt: skip
"""Least and largest of arguments that are numbers of things."""
TEXTS = {
    "ent_coef": re.compile(r"auto(?:_(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)?"),
    "target_entropy": re.compile("auto"),
}
"""What may stand in place of a number; an entropy coefficient is learned from a value on: auto_0.1."""


def find(name: str) -> type[BaseAlgorithm]:
    """An algorithm by name.

    Raises:
        InputError: there is none of this name; lists those there are.
    """
    if name not in ALGORITHMS:
        raise InputError(f"unknown algorithm {shown(name)}. There are: {choices(ALGORITHMS)}.")
    return ALGORITHMS[name]


def arguments(config: Config) -> dict[str, Any]:
    """The algorithm's arguments, checked and made into what it takes.

    Raises:
        InputError: names algorithm, key and value.
    """
    name, algorithm = config.training.algorithm, find(config.training.algorithm)
    if config.policy not in policies(name):
        raise InputError(f"policy = {shown(config.policy)}; {name} takes {choices(policies(name))}.")
    start, squashed = config.training.start, name in SQUASHED
    if start is not None and squashed and max(map(abs, start)) > NEARLY_ALL:
        raise InputError(f"training.start = {list(start)}; {name} takes from {-NEARLY_ALL} to {NEARLY_ALL}.")
    if config.training.critic and (name, config.policy, config.frame_stack) not in TWO_VIEWS:
        raise InputError(
            "training.critic is for the MlpPolicy of ppo and the MlpLstmPolicy of recurrent_ppo, without frame_stack."
        )
    _check_stage(config.training)
    _check(name, config.arguments, allowed(algorithm), OURS)
    _check_ranges(name, config.arguments)
    given = config.arguments.get("policy_kwargs", {})
    _check(f"{name}: policy_kwargs", given, allowed(algorithm.policy_aliases[config.policy]))
    _check_ranges(f"{name}: policy_kwargs", given)
    if squashed and start is None and "log_std_init" in given:
        raise InputError(f"{name}: policy_kwargs: log_std_init does nothing without training.start.")
    made = {k: _scheduled(v) for k, v in config.arguments.items()}
    if given:
        made["policy_kwargs"] = {k: activation(v) if k == "activation_fn" else v for k, v in given.items()}
    return made


def _check_stage(training: Training) -> None:
    """Refuse what does not go together: a teacher, networks to begin with, and rewards."""
    name, imitates = training.algorithm, training.algorithm == "dagger"
    if imitates and training.imitation is None:
        raise InputError("dagger needs a teacher: give training.imitation, for example {teacher: ../teacher_{seed}}.")
    if not imitates and training.imitation is not None:
        raise InputError(f"training.imitation is for the algorithm dagger, not for {name}.")
    unused = [key for key in REWARDED if imitates and getattr(training, key)]
    if unused:
        raise InputError(f"training.{unused[0]} does nothing with dagger, which learns from no reward.")
    if training.start is not None and training.initial is not None:
        raise InputError("training.start and training.initial both say where learning begins; give one of them.")
    if training.held and (training.initial is None or name in SQUASHED):
        raise InputError("training.held holds the networks of training.initial while a critic of PPO learns.")


def policies(name: str) -> list[str]:
    """Policies for observations that are vectors."""
    return [p for p in find(name).policy_aliases if p.startswith("Mlp")]


def allowed(taker: Callable[..., Any]) -> dict[str, Any]:
    """Keys that may be given, with their types."""
    taken = inspect.signature(taker, eval_str=True).parameters.values()
    refused = {*NOT_GIVEN, *(STATE_DEPENDENT if any(taker is find(n) for n in SQUASHED) else ())}
    return {p.name: p.annotation for p in taken if p.name not in refused and not p.name.endswith("_class")}


def activation(name: str) -> type[nn.Module]:
    """An activation by name: 'tanh' or 'nn.Tanh'.

    Raises:
        InputError: it is not one of those known.
    """
    key = str(name).rpartition(".")[2].lower().replace("_", "")
    if key not in ACTIVATIONS:
        raise InputError(f"policy_kwargs: activation_fn = {shown(str(name))}: expected one of {choices(ACTIVATIONS)}.")
    return ACTIVATIONS[key]


def build(config: Config, worlds: VecEnv, seed: int) -> BaseAlgorithm:
    """A fresh algorithm.

    Raises:
        InputError: the algorithm refuses its arguments.
    """
    given, critic = arguments(config), config.training.critic
    policy: Any = config.policy
    if critic:
        seen = seen_places(worlds, critic, len(config.training.traces))
        policy = TWO_VIEWS[config.training.algorithm, config.policy, config.frame_stack]
        given["policy_kwargs"] = given.get("policy_kwargs", {}) | {"seen": seen}
    if config.training.imitation is not None:
        decisions = -(-worlds.get_attr("steps", 0)[0] // config.training.hold)
        given |= {"imitation": config.training.imitation, "decisions": decisions}
    try:
        made = find(config.training.algorithm)(
            policy=policy, env=worlds, seed=seed, device=config.training.device, verbose=0, **given
        )
    except (AssertionError, ValueError, TypeError, RuntimeError, MemoryError) as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{config.training.algorithm} refuses its arguments: {said}") from None
    if config.training.start is not None:
        _begin_at(made.policy, torch.tensor(config.training.start))
    return made


def _begin_at(policy: Any, action: torch.Tensor) -> None:
    """Make an untrained policy act near an action.

    Output layers of PPO with `ortho_init` begin with weights so small that their bias is what they say. Others do not,
    and the noise of SAC and TQC covers the range; they are brought to what PPO begins with. Their noise is that of
    `log_std_init`, before the tanh, which they otherwise use for state-dependent exploration alone.
    """
    actor = getattr(policy, "actor", None)
    with torch.no_grad():
        if actor is None:
            policy.action_net.weight *= 1.0 if policy.ortho_init else SMALL
            policy.action_net.bias[:] = action
            return
        for layer, bias in ((actor.mu, torch.atanh(action)), (actor.log_std, torch.tensor(actor.log_std_init))):
            layer.weight *= SMALL
            layer.bias[:] = bias


def _check(who: str, given: Any, known: Mapping[str, Any], others: Sequence[str] = ()) -> None:
    """Refuses unknown keys and wrong types; `others`: keys that may stand beside these."""
    if not isinstance(given, Mapping):
        raise InputError(f"{who} = {shown(given)}: expected a mapping.")
    for key, value in given.items():
        if key not in known:
            raise InputError(f"{who}: unknown key '{cut(key)}'. Allowed: {choices([*known, *others])}.")
        if key != "activation_fn" and not fits(value, known[key]):
            raise InputError(f"{who}: {key} = {shown(value)}: expected {_in_words(known[key])}.")


def _check_ranges(who: str, given: Mapping[str, Any]) -> None:
    """Refuses numbers with which nothing is learned, of a fitting type; a schedule is judged by its start."""
    for key, value in given.items():
        number = float(value.removeprefix("lin_")) if isinstance(value, str) and SCHEDULE.fullmatch(value) else value
        if key in SHARES and not 0.0 <= number <= 1.0:
            raise InputError(f"{who}: {key} = {shown(value)}: expected a number from 0 to 1.")
        if key in POSITIVE and not 0.0 < number < math.inf:
            raise InputError(f"{who}: {key} = {shown(value)}: expected a positive number.")
        if key in TEXTS and isinstance(value, str) and not TEXTS[key].fullmatch(value):
            raise InputError(f"{who}: {key} = {shown(value)}: expected a number or auto.")
        if key == "policy_kwargs":
            continue  # has ranges of its own
        least, most = COUNTS.get(key, (-LARGEST, LARGEST))
        if not all(least <= x <= most for x in _numbers(value)):
            raise InputError(f"{who}: {key} = {shown(value)}: expected numbers from {least:g} to {most:g}.")


def _numbers(value: Any) -> Iterator[float]:
    """All numbers in a value."""
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for one in value:
            yield from _numbers(one)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield value


def fits(value: Any, hint: Any) -> bool:
    """Whether a value from a file is of an annotated type."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return any(fits(value, one) for one in inner)
    if origin is Callable or hint is Callable or origin is not None and issubclass(origin, Callable):  # type: ignore[arg-type]
        return isinstance(value, str) and SCHEDULE.fullmatch(value) is not None
    if origin is tuple:
        return isinstance(value, list | tuple) and len(value) == len(inner) and all(map(fits, value, inner))
    if origin is list:
        return isinstance(value, list | tuple) and all(fits(v, inner[0]) for v in value)
    if origin is dict:
        return isinstance(value, Mapping) and all(fits(v, inner[1]) for v in value.values())
    if hint is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    if hint is int:
        return isinstance(value, int) and not isinstance(value, bool)
    return value is None if hint in (None, type(None)) else hint is Any or isinstance(value, hint)


def _in_words(hint: Any) -> str:
    """A type in words."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return " or ".join(dict.fromkeys(_in_words(one) for one in inner))
    plain = {float: "a number", int: "a whole number", bool: "true or false", str: "text", type(None): "null"}
    if hint in plain:
        return plain[hint]
    if origin in (list, tuple):
        return f"a list of {' and '.join(dict.fromkeys(_in_words(one) for one in inner))}"
    return "a mapping" if origin is dict else "text like lin_3e-4"


def _scheduled(value: Any) -> Any:
    """What the algorithm takes for a value of a file."""
    if isinstance(value, str) and SCHEDULE.fullmatch(value):
        return LinearSchedule(float(value.removeprefix("lin_")), 0.0, 1.0)
    return tuple(value) if isinstance(value, list) else value

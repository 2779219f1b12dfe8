"""A critic that sees more than the policy (Pinto et al. 2018, arXiv:1710.06542): the patient, whom no sensor shows.

What a patient answers to an error comes seconds later and lies in the effort, which no sensor shows. A critic that sees
it knows at once what an error was worth. The policy's own inputs stay those of its sensors, so that it acts anywhere.
"""

# The base's method is static, and without the training libraries there is no base to differ from.
# mypy: disable-error-code="override"

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from dms_core.errors import InputError, choices


class TwoViews(nn.Module):
    """Layers of actor and critic, each behind its own part of the observation.

    Args:
        inputs: components of the observation.
        seen: places of those that the actor sees.
        net_arch: widths of the layers, as in Stable-Baselines3.
        activation: between the layers.
        device: of PyTorch.
    """

    def __init__(
        self, inputs: int, seen: Sequence[int], net_arch: Any, activation: type[nn.Module], device: Any
    ) -> None:
        super().__init__()
        self.seen = list(seen)
        judge = MlpExtractor(inputs, net_arch, activation, device)
        actor = MlpExtractor(len(self.seen), net_arch, activation, device)
        self.policy_net, self.value_net = actor.policy_net, judge.value_net
        self.latent_dim_pi, self.latent_dim_vf = actor.latent_dim_pi, judge.latent_dim_vf

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Latent values of actor and critic."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Latent values of the actor, from what it sees."""
        return self.policy_net(features[:, self.seen])

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Latent values of the critic, from everything."""
        return self.value_net(features)


class TwoViewPolicy(ActorCriticPolicy):
    """MlpPolicy of PPO with an actor that sees a part of what the critic sees.

    Args:
        seen: places of the observation's components that the actor sees.
        given: as for MlpPolicy.
    """

    def __init__(self, *given: Any, seen: Sequence[int], **more: Any) -> None:
        self.seen = list(seen)
        super().__init__(*given, **more)

    def _build_mlp_extractor(self) -> None:
        layers: Any = TwoViews(self.features_dim, self.seen, self.net_arch, self.activation_fn, self.device)
        self.mlp_extractor = layers

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return super()._get_constructor_parameters() | {"seen": self.seen}


class TwoViewLstmPolicy(RecurrentActorCriticPolicy):
    """MlpLstmPolicy of recurrent PPO with an actor that sees a part of what the critic sees.

    Args:
        seen: places of the observation's components that the actor sees.
        given: as for MlpLstmPolicy.
    """

    lstm_actor: nn.LSTM

    def __init__(self, *given: Any, seen: Sequence[int], **more: Any) -> None:
        super().__init__(*given, **more)
        self.seen = list(seen)
        wide, schedule = self.lstm_actor, given[2] if len(given) > 2 else more["lr_schedule"]
        self.lstm_actor = nn.LSTM(len(self.seen), wide.hidden_size, num_layers=wide.num_layers)
        made: Any = self.optimizer_class
        self.optimizer = made(self.parameters(), lr=schedule(1), **self.optimizer_kwargs)

    def _process_sequence(
        self,
        features: torch.Tensor,
        lstm_states: tuple[torch.Tensor, torch.Tensor],
        episode_starts: torch.Tensor,
        lstm: nn.LSTM,
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """As of sb3-contrib, from what the cells see; a sequence in which no episode begins is one call."""
        # In training sequences are split where episodes begin, so that only their first state has to be forgotten.
        if lstm is self.lstm_actor:
            features = features[:, self.seen]
        starts = episode_starts.reshape(lstm_states[0].shape[1], -1)
        if starts[:, 1:].any():
            return super()._process_sequence(features, lstm_states, episode_starts, lstm)
        kept = (1.0 - starts[:, 0])[None, :, None]
        states = (kept * lstm_states[0], kept * lstm_states[1])
        return super()._process_sequence(features, states, torch.zeros_like(episode_starts), lstm)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return super()._get_constructor_parameters() | {"seen": self.seen}


def actor_size(worlds: VecEnv, critic: Sequence[str]) -> int:
    """Components of an observation, the first ones, that are not for the critic alone.

    Args:
        worlds: that are observed.
        critic: what only the critic sees: groups, or single channels as "group.channel".

    Raises:
        InputError: one of these is not observed, or the actor sees something that stands behind them.
    """
    parts = worlds.get_attr("observation_structure", 0)[0]
    single = [f"{part.group}.{part.name}" for part in parts]
    for name in critic:
        if name not in {*single, *(part.group for part in parts)}:
            groups = dict.fromkeys(part.group for part in parts)
            raise InputError(f"training.critic: '{name}' is not observed; there are {choices([*groups, *single])}.")
    hidden = [part.group in critic or name in critic for part, name in zip(parts, single, strict=True)]
    if hidden != sorted(hidden):
        order = ", ".join(single)
        raise InputError(f"training.critic: expected what only the critic sees behind all else, got {order}.")
    return sum(part.stop - part.start for part, only in zip(parts, hidden, strict=True) if not only)


def seen_places(worlds: VecEnv, critic: Sequence[str], filters: int) -> list[int]:
    """Places of what the actor sees; behind what everybody sees stand its filtered observations."""
    single: Any = worlds.observation_space
    actor = actor_size(worlds, critic)
    return [*range(actor), *range(single.shape[0] - filters * actor, single.shape[0])]

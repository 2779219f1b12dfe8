"""DAgger as an algorithm of Stable-Baselines3, so that all that watches, keeps and exports these holds for it too.

A round is an episode of every world. The student sees what its sensors show; its loss is the mean over what the teacher
said in the last rounds,

    |mean action of the student - action of the teacher|^2

followed back in time over segments of an episode (truncated backpropagation), the state of the cells going on from one
segment to the next. See imitation.py.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import torch
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule
from stable_baselines3.common.vec_env import VecEnv

from ..settings.imitation import Imitation
from ..wrappers.taught import Taught
from .demonstrations import Demonstrations

State = tuple[torch.Tensor, torch.Tensor] | None
"""Of LSTM cells, each (layers, worlds, width); None: at the start."""


class Dagger(OnPolicyAlgorithm):
    """A student that imitates a teacher.

    Args:
        policy: MlpPolicy, or MlpLstmPolicy, whose cells remember.
        env: worlds with `Taught` among their wrappers.
        learning_rate: of Adam.
        batch_size: decisions in a step of Adam.
        n_epochs: how often all that is kept is gone through after a round.
        max_grad_norm: largest norm of a gradient.
        policy_kwargs: of the policy; the critic is not trained.
        imitation: how it learns.
        decisions: in an episode.
        seed: of the networks, and of the order in which they learn.
        device: of PyTorch.
        verbose: as in Stable-Baselines3.
    """

    policy_aliases: ClassVar[dict[str, Any]] = {
        "MlpPolicy": ActorCriticPolicy, "MlpLstmPolicy": RecurrentActorCriticPolicy,
    }  # fmt: skip

    def __init__(
        self,
        policy: str | type[ActorCriticPolicy],
        env: Any,
        learning_rate: float | Schedule = 1e-3,
        batch_size: int = 9600,
        n_epochs: int = 1,
        max_grad_norm: float = 1.0,
        policy_kwargs: dict[str, Any] | None = None,
        imitation: Imitation | None = None,
        decisions: int = 1,
        seed: int | None = None,
        device: str = "cpu",
        verbose: int = 0,
        _init_setup_model: bool = True,
    ) -> None:
        super().__init__(
            policy, env, learning_rate, n_steps=decisions, gamma=1.0, gae_lambda=1.0, ent_coef=0.0, vf_coef=0.0,
            max_grad_norm=max_grad_norm, use_sde=False, sde_sample_freq=-1, policy_kwargs=policy_kwargs,
            verbose=verbose, seed=seed, device=device, _init_setup_model=False,
        )  # fmt: skip
        self.batch_size, self.n_epochs, self.imitation = batch_size, n_epochs, imitation
        if _init_setup_model:
            self._setup_model()

    def _setup_model(self) -> None:
        """The student; there is no buffer of rewards."""
        self._setup_lr_schedule()
        self.set_random_seed(self.seed)
        self.rollout_buffer: Any = None
        kind: Any = self.policy_class
        self.policy = kind(self.observation_space, self.action_space, self.lr_schedule, **self.policy_kwargs)
        self.policy = self.policy.to(self.device)
        if self.env is not None and self.imitation is not None:
            shapes: Any = (self.observation_space.shape, self.action_space.shape)
            sizes = (self.n_steps, self.n_envs, shapes[0][0], shapes[1][0])
            self.demonstrations = Demonstrations(self.imitation.kept, sizes)

    def collect_rollouts(self, env: VecEnv, callback: BaseCallback, rollout_buffer: Any, n_rollout_steps: int) -> bool:
        """A round: an episode of every world, from its start; returns whether it came to its end."""
        assert self.imitation is not None
        self.policy.set_training_mode(False)
        callback.on_rollout_start()
        taught = _taught(env)
        left = 1.0 - self.num_timesteps / self.imitation.driven if self.imitation.driven else 0.0
        driven = np.arange(self.n_envs)[:, None] < round(max(left, 0.0) * self.n_envs)
        seen: Any = env.reset()
        rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        over, state = np.zeros(self.n_envs, bool), None
        for _ in range(n_rollout_steps):
            rows.append((self._as_shown(seen), taught.advice, ~over))
            with torch.no_grad():
                actions, state = self.acting(torch.as_tensor(seen, device=self.device)[None], state)
            driving = np.where(driven, taught.advice, actions[0].cpu().numpy())
            if self.imitation.noise:
                driving = driving + self.imitation.noise * torch.randn(driving.shape).numpy()
            seen, _, ended, infos = env.step(np.clip(driving, -1.0, 1.0))
            self.num_timesteps += self.n_envs
            if not callback.on_step():
                return False
            self._update_info_buffer(infos, ended)
            over = over | ended
        shown, advice, live = (np.stack(column) for column in zip(*rows, strict=True))
        self.demonstrations.add(shown, advice, live)
        callback.on_rollout_end()
        return True

    def train(self) -> None:
        """Fit the student to what the teacher said in the rounds that are kept."""
        assert self.imitation is not None
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        shown, advice, live = self.demonstrations.episodes()
        seen, advised, counted = (
            torch.as_tensor(x, dtype=torch.float32, device=self.device) for x in (self._normalised(shown), advice, live)
        )
        at_once = max(1, self.batch_size // min(self.imitation.segment, len(seen)))
        losses = []
        for _ in range(self.n_epochs):
            for which in torch.randperm(seen.shape[1]).split(at_once):
                losses += self._fit(seen[:, which], advised[:, which], counted[:, which])
        self._n_updates += self.n_epochs
        self.logger.record("train/loss", float(np.mean(losses)))

    def _fit(self, seen: torch.Tensor, advised: torch.Tensor, counted: torch.Tensor) -> list[float]:
        """A step of Adam for each segment of some episodes, (decisions, episodes, ...); gives the losses."""
        assert self.imitation is not None
        losses, state = [], None
        parts = (x.split(self.imitation.segment) for x in (seen, advised, counted))
        for inputs, wanted, weights in zip(*parts, strict=True):
            mean, state = self.acting(inputs, state)
            if not weights.any():
                break
            loss = (((mean - wanted) ** 2).mean(dim=-1) * weights).sum() / weights.sum()
            self.policy.optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
            self.policy.optimizer.step()
            state = None if state is None else (state[0].detach(), state[1].detach())
            losses.append(float(loss.detach()))
        return losses

    def acting(self, seen: torch.Tensor, state: State) -> tuple[torch.Tensor, State]:
        """Mean actions (decisions, worlds, actions) after normalised observations, and the state of the cells then."""
        policy: Any = self.policy
        if hasattr(policy, "lstm_actor"):
            seen, state = policy.lstm_actor(seen, state)
        return policy.action_net(policy.mlp_extractor.forward_actor(seen)), state

    def _as_shown(self, seen: np.ndarray) -> np.ndarray:
        """Observations before their normalisation, whose statistics still change."""
        statistics = self.get_vec_normalize_env()
        if statistics is None:
            return seen
        shown = statistics.get_original_obs()
        assert isinstance(shown, np.ndarray)
        return shown

    def _normalised(self, shown: np.ndarray) -> np.ndarray:
        """Observations with the statistics of now."""
        statistics = self.get_vec_normalize_env()
        if statistics is None:
            return shown
        seen = statistics.normalize_obs(shown)
        assert isinstance(seen, np.ndarray)
        return seen

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "demonstrations"]


def _taught(env: Any) -> Taught:
    """The worlds' wrapper that has the teacher."""
    while not isinstance(env, Taught):
        env = env.venv
    return env

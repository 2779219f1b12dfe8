"""PPO by the shipped recipe, on `device` and on what an estimator of the plan holds."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper, VecNormalize

from agents.environment import patient_seeds
from agents.policies.learned import LearnedPolicy
from agents.training.learners.algorithms import arguments
from agents.training.learners.critic import TwoViewPolicy
from agents.training.networks.extraction import actor_parameters
from agents.training.networks.initial import hold_actor
from agents.training.settings.config import Config
from agents.training.worlds import training_worlds
from agents.training.wrappers.low_pass import LowPassObservations, kept_shares
from dms_core.files.config_files import configs
from tests.benchmarks.plan.believer import Belief, Believer
from tests.benchmarks.plan.plan_episodes import TARGETS, record
from tests.benchmarks.plan.plan_estimator import PlanEstimator

RECIPE = Path("agents/hidden_intent/ppo.yml")
TOLD = tuple(
    TARGETS.index(x) for x in ("intent", "intent_rate", "intent in 0.1 s", "intent in 0.2 s", "intent in 0.4 s")
)
"""What the policy that is told the plan sees of it, in its order."""
HELD = 96_000
"""Steps in which the critic of a policy that knows something already learns alone."""
HIDDEN = 16
"""Cells that the policy sees."""
JUDGED = 240_000
"""Steps from one look at the patients that are set aside to the next."""


def shown(belief: Belief) -> np.ndarray:
    """What a policy sees of it: means, those of TOLD first, log-variances and some cells, shape (n, 12 + HIDDEN)."""
    means = [belief.mean[:, list(TOLD)], np.delete(belief.mean, TOLD, axis=1)]
    return np.concatenate([*means, belief.log_variance, belief.hidden[:, :HIDDEN]], axis=1)


class BeliefObservations(VecEnvWrapper):
    """Worlds that show the device, what is held of the plan, and then all else.

    Args:
        worlds: that show `device` first.
        estimator: of the plan from `device`.
        device: components of that group.
    """

    def __init__(self, worlds: VecEnv, estimator: PlanEstimator, device: int) -> None:
        single: Any = worlds.observation_space
        size = single.shape[0] + 2 * 6 + HIDDEN
        super().__init__(worlds, observation_space=spaces.Box(-np.inf, np.inf, (size,), np.float32))
        self.believer, self._device = Believer(estimator), device
        self._begun = np.ones(worlds.num_envs, bool)

    def reset(self) -> np.ndarray:
        """First observations."""
        self.believer.begin()
        return self._joined(self.venv.reset(), None)

    def step_wait(self) -> tuple:
        """A control period; the last observation of an episode is shown with what was held before it."""
        seen, rewards, over, infos = self.venv.step_wait()
        held = self._held
        for i in np.flatnonzero(over):
            infos[i]["terminal_observation"] = self._with(infos[i]["terminal_observation"][None], held[i : i + 1])[0]
        return self._joined(seen, over), rewards, over, infos

    def _joined(self, seen: Any, begun: np.ndarray | None) -> np.ndarray:
        self._held = shown(self.believer.believe(seen, begun))
        return self._with(seen, self._held)

    def _with(self, seen: np.ndarray, held: np.ndarray) -> np.ndarray:
        d = self._device
        return np.concatenate([seen[:, :d], held, seen[:, d:]], axis=1, dtype=np.float32)


class BeliefLearning:
    """A training.

    Args:
        estimator: whose beliefs are shown, frozen.
        steps: over which the learning rate falls.
        seed: of the worlds and the networks.
        told: policy that was told the plan, which learning begins with; None: from scratch.
    """

    def __init__(self, estimator: PlanEstimator, steps: int, seed: int, told: LearnedPolicy | None = None) -> None:
        config = Config.read(configs() / RECIPE, [f"n_timesteps={steps}"])
        self._settings = {**config.env_kwargs, "observation": ["device", "privileged"]}
        worlds = training_worlds(self._settings, config.n_envs, seed + 5000, None, config.environment)
        self.device = sum(
            p.stop - p.start for p in worlds.get_attr("observation_structure", 0)[0] if p.group == "device"
        )
        self.kept = kept_shares(config.training.traces, worlds.get_attr("period", 0)[0])
        self._beliefs = BeliefObservations(worlds, estimator, self.device)
        self.filtered = self.device + (0 if told is None else len(TOLD))
        both = LowPassObservations(self._beliefs, self.kept, self.filtered)
        self._worlds = VecNormalize(both, **(config.normalize or {}))
        size, seen = both.observation_space.shape[0], self.device + 12 + HIDDEN
        self._seen = [*range(seen), *range(size - len(self.kept) * self.filtered, size)]
        given = arguments(config)
        given["policy_kwargs"] = given["policy_kwargs"] | {"seen": self._seen}
        self.model = PPO(TwoViewPolicy, self._worlds, seed=seed, device="cpu", verbose=0, **given)
        self.held = 0
        if told is not None:
            self._begin_with(told)
        self._aside = patient_seeds(config.training.eval_seed, config.training.eval_patients)
        self.estimator, self._best = estimator, (-np.inf, self._state())

    def learn(self, steps: int) -> None:
        """Go on, with a learning rate that falls anew; the best of what is judged on the way is kept."""
        done, kept = 0, self.model.lr_schedule
        begin = kept(1.0) if self.model.num_timesteps == 0 and not self.held else 0.5 * kept(1.0)
        while done < steps:
            part = min(self.held or JUDGED, steps - done)
            hold_actor(self.model, bool(self.held))
            self.held = 0
            left = 1.0 - done / steps
            self.model.lr_schedule = lambda _, x=begin * left: x
            self.model.learn(part, reset_num_timesteps=False)
            done += part
            self._judge()
        self._set_state(self._best[1])

    def _begin_with(self, told: LearnedPolicy) -> None:
        """Give the actor the networks of a policy that was told the plan; what else it sees counts for nothing yet."""
        places = [*range(self.filtered), *range(len(self._seen) - len(self.kept) * self.filtered, len(self._seen))]
        inputs = {"layer.0.weight": places}
        with torch.no_grad():
            for name, parameter in actor_parameters(self.model).items():
                array = torch.as_tensor(told.arrays[name])
                parameter.zero_()
                parameter[..., inputs.get(name, slice(None))] = array.to(parameter.dtype)
            self.model.policy.log_std.fill_(-2.0)
        known, where = self._worlds.obs_rms, np.array(self._seen)[places]
        known.mean[where], known.var[where] = told.arrays["mean"], told.arrays["variance"]
        # As after the training that they are of; what is new keeps the scales of its channels.
        known.count = float(told.description.steps)
        self.held = HELD

    def believe(self, estimator: PlanEstimator) -> None:
        """Show the beliefs of another estimator from now on."""
        self.estimator = self._beliefs.believer.estimator = estimator
        self._best = (-np.inf, self._state())

    def driver(self) -> BeliefPolicy:
        """The policy of now."""
        return BeliefPolicy(self)

    def act(self, seen: np.ndarray) -> np.ndarray:
        """Mean actions for what the actor sees, shape (n, 2)."""
        whole = np.zeros((len(seen), self.model.observation_space.shape[0]), np.float32)
        whole[:, self._seen] = seen
        return self.model.predict(self._worlds.normalize_obs(whole), deterministic=True)[0]

    def _judge(self) -> None:
        found = float(record("wide", self._aside, [self.driver()]).returns.mean())
        print(f"PPO {self.model.num_timesteps} steps: {found:.1f} on the patients set aside", flush=True)
        if found > self._best[0]:
            self._best = (found, self._state())

    def _state(self) -> tuple[Any, Any]:
        return copy.deepcopy(self.model.policy.state_dict()), copy.deepcopy(self._worlds.obs_rms)

    def _set_state(self, state: tuple[Any, Any]) -> None:
        self.model.policy.load_state_dict(state[0])
        self._worlds.obs_rms = copy.deepcopy(state[1])


class BeliefPolicy:
    """What a training has learned so far, as a driver of worlds that show all groups.

    Args:
        learning: the training.
    """

    def __init__(self, learning: BeliefLearning) -> None:
        self._learning, self._believer = learning, Believer(learning.estimator)
        self.told: list[np.ndarray] = []

    def begin(self, worlds: int) -> None:
        """Begin an episode in each world."""
        self._believer.begin()
        self._memory: np.ndarray | None = None
        self.told.clear()

    def act(self, observations: np.ndarray) -> np.ndarray:
        """Actions, shape (n, 2)."""
        one = self._learning
        belief = self._believer.believe(observations)
        self.told.append(belief.mean[:, 0])
        whole = np.concatenate([observations[:, : one.device], shown(belief)], axis=1)
        seen = whole[:, : one.filtered]
        kept = np.array(one.kept)[:, None]
        if self._memory is None:
            self._memory = np.repeat(seen[:, None], len(kept), axis=1).astype(float)
        self._memory += (1.0 - kept) * (seen[:, None] - self._memory)
        return one.act(np.concatenate([whole, self._memory.reshape(len(seen), -1)], axis=1))

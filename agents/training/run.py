"""Training: an algorithm learns, is watched on patients of its own, and is kept so that any death can be survived."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv, VecFrameStack, VecNormalize

from agents.evaluation.evaluate import ENVIRONMENT, episode, patient_seeds
from agents.export.extraction import extract
from agents.policies.learned import LearnedPolicy
from agents.training.algorithms import arguments, build
from agents.training.config import Config
from agents.training.critic import actor_size
from agents.training.model_state import load_state, save_model, save_state
from agents.training.run_folder import EVALUATIONS, RunFolder
from agents.training.worlds import training_worlds
from agents.training.wrappers.action_repeat import Held
from agents.training.wrappers.low_pass import Traces, kept_shares
from dms_core.errors import DmsError, InputError
from dms_core.output_file import write_json

STATE = "state.json"
Report = Callable[[int, dict[str, Any] | None], None]
"""Called with the steps done, and with an evaluation where there is a new one."""


class TrainingRun:
    """One training in its folder, from its start or from its last checkpoint.

    Args:
        folder: begun, with the configuration in it.
        config: of the training.
        seed: decides all that is random.
        report: told how far it is.
        stop: asked after every step whether to end early.

    Raises:
        InputError: the configuration is not usable, or the checkpoint does not fit it.
    """

    def __init__(
        self, folder: RunFolder, config: Config, seed: int, report: Report, stop: Callable[[], bool] = lambda: False
    ) -> None:
        self.folder, self.config, self.seed, self.report, self.stop = folder, config, seed, report, stop
        torch.set_num_threads(config.training.threads)
        self.seconds, self.evaluations = 0.0, list[dict[str, Any]]()
        checkpoint = None if folder.checkpoints.empty else folder.checkpoints.latest()
        state = _state(checkpoint)
        # Episodes cannot be stored half-way: a training that goes on begins new ones, with numbers of their own.
        self.model = build(config, wrapped(config, mixed(seed, state["steps"])), mixed(seed, state["steps"]))
        self.env = gymnasium.make(ENVIRONMENT, disable_env_checker=True, **config.env_kwargs)
        self.seeds = patient_seeds(config.training.eval_seed, config.training.eval_patients)
        if checkpoint is not None:
            load_state(self.model, checkpoint)
            self._restore(state)
        self.saved = state["steps"] if checkpoint is not None else -1

    @property
    def steps(self) -> int:
        """Environment steps done."""
        return self.model.num_timesteps

    @property
    def end(self) -> int:
        """Steps after which training ends: whole rounds between two updates of the networks."""
        one: Any = self.model
        on_policy = isinstance(one, OnPolicyAlgorithm)
        size = one.n_envs * (one.n_steps if on_policy else one.train_freq.frequency)
        left = max(self.config.n_timesteps - self.steps, 0)
        return self.steps + -(-left // size) * size

    def run(self) -> bool:
        """Train to the end, or until told to stop; returns whether it came to the end.

        Raises:
            DmsError: the disk is full, or the networks diverge; the last checkpoint is whole.
        """
        left = self.config.n_timesteps - self.steps
        self._began = time.perf_counter() - self.seconds
        self.model.set_logger(configure(str(self.folder.path / "tensorboard"), ["tensorboard"]))
        try:
            if left > 0:
                self.model.learn(left, callback=_Watch(self), reset_num_timesteps=False)
            done = self.steps >= self.config.n_timesteps
            if done and (not self.evaluations or self.evaluations[-1]["steps"] < self.steps):
                self.evaluate()
            self.save()
        except OSError as error:
            raise DmsError(
                f"'{self.folder.path}' cannot be written: {error.strerror or error}. {self._advice()}"
            ) from None
        except ValueError as error:
            if isinstance(error, DmsError) or not _diverged(self.model, error):
                raise
            raise DmsError(f"after {self.steps} steps the networks have diverged. {self._advice()}") from None
        finally:
            self.env.close()
            worlds = self.model.get_env()
            if worlds is not None:
                worlds.close()
            self.model.logger.close()
        return done

    def evaluate(self) -> None:
        """How good the policy is on the patients set aside; the best one is kept."""
        policy = self.policy()
        found = [episode(self.env, policy, seed)["measures"] for seed in self.seeds]
        returns = [float(m["return"]) for m in found]
        means = {name: _mean([m[name] for m in found]) for name in found[0]}
        record = {"steps": self.steps, "seconds": round(self._clock(), 3), **means, "returns": returns}
        for name, value in means.items():
            if value is not None:
                self.model.logger.record(f"evaluation/{name}", value)
        self.model.logger.dump(self.steps)
        if np.mean(returns) > self._best():
            self.folder.best.save(_name(self.steps), lambda part: self._write_best(part, policy, record))
        self.evaluations.append(record)
        write_json(self.folder.path / EVALUATIONS, self.evaluations)
        self.report(self.steps, record)

    def save(self) -> None:
        """A checkpoint of now, unless there is one."""
        if self.steps == self.saved:
            return
        self.seconds = self._clock()
        state = {
            "steps": self.steps, "updates": int(self.model._n_updates), "episodes": int(self.model._episode_num),
            "seconds": self.seconds, "evaluations": self.evaluations,
        }  # fmt: skip

        def write(part: Path) -> None:
            save_state(self.model, part)
            self.policy().save(part)
            (part / STATE).write_text(json.dumps(state), encoding="utf-8")

        self.folder.checkpoints.save(_name(self.steps), write)
        self.saved = self.steps

    def policy(self) -> LearnedPolicy:
        """The policy of now."""
        return extract(
            self.model, self.env, algorithm=self.config.training.algorithm, env_kwargs=self.config.env_kwargs,
            seed=self.seed, traces=self.config.training.traces, hold=self.config.training.hold,
        )  # fmt: skip

    def _write_best(self, part: Path, policy: LearnedPolicy, record: dict[str, Any]) -> None:
        save_model(self.model, part)
        policy.save(part)
        (part / STATE).write_text(json.dumps(record), encoding="utf-8")

    def _best(self) -> float:
        """Mean return of the policy that is kept; it may be of a stretch that was lost and is trained again."""
        if self.folder.best.empty:
            return -np.inf
        try:
            return float(json.loads((self.folder.best.latest() / STATE).read_text(encoding="utf-8"))["return"])
        except InputError:
            return -np.inf

    def _restore(self, state: dict[str, Any]) -> None:
        """Counters of a checkpoint."""
        self.model.num_timesteps, self.model._n_updates = state["steps"], state["updates"]
        self.model._episode_num = state["episodes"]
        self.seconds, self.evaluations = state["seconds"], state["evaluations"]
        write_json(self.folder.path / EVALUATIONS, self.evaluations)

    def _clock(self) -> float:
        """Seconds of training, those before the last start included."""
        return time.perf_counter() - self._began

    def _advice(self) -> str:
        """What is left, and how to go on."""
        if self.folder.checkpoints.empty:
            return "There is no checkpoint yet."
        last = self.folder.checkpoints.latest()
        return f"The last whole checkpoint is '{last}'; go on with --resume {self.folder.path}"


class _Watch(BaseCallback):
    """Evaluates and saves between two updates, where a rollout begins and nothing is half done."""

    def __init__(self, run: TrainingRun) -> None:
        super().__init__()
        self.run, self.begun = run, run.steps

    def _on_rollout_start(self) -> None:
        run, settings = self.run, self.run.config.training
        self.begun = run.steps
        last = run.evaluations[-1]["steps"] if run.evaluations else -settings.eval_every
        if run.steps - last >= settings.eval_every:
            run.evaluate()
        if run.steps - max(run.saved, 0) >= settings.save_every:
            run.save()

    def _on_step(self) -> bool:
        self.run.report(self.run.steps, None)
        if not self.run.stop():
            return True
        # The rollout begun is lost, so its steps do not count.
        self.model.num_timesteps = self.begun
        return False


def wrapped(config: Config, seed: int) -> VecEnv:
    """Training environments, observations stacked and then normalised if the configuration says so.

    rl_zoo3 normalises first; then algorithms with a replay buffer could not have both.
    """
    arguments(config)
    own, more = list(config.env_kwargs.get("observation", ("device",))), config.training.critic
    worlds = training_worlds(
        config.env_kwargs | {"observation": [*own, *more]}, config.n_envs, seed, config.training.against
    )
    period = config.training.hold * worlds.get_attr("period", 0)[0]
    if config.training.hold > 1:
        worlds = Held(worlds, config.training.hold)
    if config.frame_stack > 1:
        worlds = VecFrameStack(worlds, config.frame_stack)
    if config.training.traces:
        kept = kept_shares(config.training.traces, period)
        worlds = Traces(worlds, kept, config.frame_stack * actor_size(worlds, more))
    return worlds if config.normalize is None else VecNormalize(worlds, **config.normalize)


def mixed(seed: int, steps: int) -> int:
    """Seed of the environments from a run's seed: neighbours share none, nor do a run's parts."""
    return int(np.random.SeedSequence([seed, steps]).generate_state(1)[0]) >> 1


def _state(checkpoint: Path | None) -> dict[str, Any]:
    """Counters of a checkpoint; those of a start where there is none."""
    if checkpoint is None:
        return {"steps": 0}
    return json.loads((checkpoint / STATE).read_text(encoding="utf-8"))


def _name(steps: int) -> str:
    return f"steps_{steps:010d}"


def _mean(values: list[Any]) -> float | None:
    """Mean of what could be measured."""
    kept = [v for v in values if np.isfinite(v)]
    return float(np.mean(kept)) if kept else None


def _diverged(model: BaseAlgorithm, error: ValueError) -> bool:
    """Whether it is the numbers that an error comes from: PyTorch's distributions refuse what is not finite."""
    finite = all(bool(torch.isfinite(p).all()) for p in model.policy.parameters())
    return not finite or str(error).startswith("Expected parameter")

"""Training: an algorithm learns, is watched on patients of its own, and can go on after any interruption."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from dms_core.errors import DmsError
from dms_core.files.output_file import write_text
from dms_core.files.output_place import cannot

from ..policies.learned import LearnedPolicy
from .files.model_state import load_state, save_state
from .files.records import STATE, read_state
from .files.run_folder import RunFolder
from .learners.algorithms import build
from .learning_curve import Judge, LearningCurve, checkpoint_name
from .networks.extraction import Origin, extract
from .networks.initial import begin_with, hold_actor
from .settings.config import Config
from .worlds import wrapped

Report = Callable[[int, dict[str, Any] | None], None]
"""Called with the steps done, and with an evaluation where there is a new one."""


class TrainingRun:
    """One training in its folder, from its start or from its last checkpoint.

    Args:
        folder: begun, with the configuration in it.
        config: of the training.
        seed: decides all that is random.
        report: is called with how far it is.
        judge: measures what the policy does with patients, see learning_curve.py.
        stop: is asked after every step whether to end early.

    Raises:
        InputError: the configuration is not usable, or the checkpoint does not fit it.
    """

    def __init__(
        self,
        folder: RunFolder,
        config: Config,
        seed: int,
        report: Report,
        judge: Judge,
        stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self.folder, self.config, self.seed, self.report, self.stop = folder, config, seed, report, stop
        torch.set_num_threads(config.training.threads)
        self.seconds = 0.0
        checkpoint = None if folder.checkpoints.empty else folder.checkpoints.latest()
        state = _state(checkpoint)
        # Episodes cannot be stored half-way: a training that goes on begins new ones, with numbers of their own.
        self.model = build(config, wrapped(config, mixed(seed, state["steps"])), mixed(seed, state["steps"]))
        self.curve = LearningCurve(folder, config, judge)
        if checkpoint is not None:
            load_state(self.model, checkpoint)
            self._restore(state)
        elif config.training.initial is not None:
            begin_with(self.model, config.training.initial, self.curve.env, self._origin())
        self.saved = state["steps"] if checkpoint is not None else -1

    @property
    def evaluations(self) -> list[dict[str, Any]]:
        """Those so far, first to last."""
        return self.curve.evaluations

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
        logger = None
        try:
            logger = configure(str(self.folder.path / "tensorboard"), ["tensorboard"])
            self.model.set_logger(logger)
            if left > 0:
                self.model.learn(left, callback=_Watch(self), reset_num_timesteps=False)
            done = self.steps >= self.config.n_timesteps
            if done and (not self.evaluations or self.evaluations[-1]["steps"] < self.steps):
                self.evaluate()
            self.save()
        except OSError as error:
            raise DmsError(f"{cannot(self.folder.path, error)} {self._advice()}") from None
        except ValueError as error:
            if isinstance(error, DmsError) or not _diverged(self.model, error):
                raise
            raise DmsError(f"after {self.steps} steps the networks have diverged. {self._advice()}") from None
        finally:
            self.curve.env.close()
            worlds = self.model.get_env()
            if worlds is not None:
                worlds.close()
            if logger is not None:
                logger.close()
        return done

    def evaluate(self) -> None:
        """Evaluate the policy of now on the patients set aside."""
        self.report(self.steps, self.curve.evaluate(self.policy(), self.model, self._clock()))

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
            write_text(part / STATE, json.dumps(state))

        self.folder.checkpoints.save(checkpoint_name(self.steps), write)
        self.saved = self.steps

    def policy(self) -> LearnedPolicy:
        """The policy of now."""
        return extract(self.model, self.curve.env, self._origin())

    def _origin(self) -> Origin:
        """What the policy is trained with."""
        training = self.config.training
        return Origin(
            self.config.environment, training.algorithm, self.seed, self.config.env_kwargs, training.traces,
            training.hold,
        )  # fmt: skip

    def _restore(self, state: dict[str, Any]) -> None:
        """Counters of a checkpoint."""
        self.model.num_timesteps, self.model._n_updates = state["steps"], state["updates"]
        self.model._episode_num = state["episodes"]
        self.seconds = state["seconds"]
        self.curve.restore(state["evaluations"])

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
        if settings.held:
            hold_actor(run.model, run.steps < settings.held)
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


def mixed(seed: int, steps: int) -> int:
    """Seed of the environments from a run's seed: neighbours share none, nor do a run's parts."""
    return int(np.random.SeedSequence([seed, steps]).generate_state(1)[0]) >> 1


def _state(checkpoint: Path | None) -> dict[str, Any]:
    """Counters of a checkpoint; those of a start where there is none."""
    return {"steps": 0} if checkpoint is None else read_state(checkpoint)


def _diverged(model: BaseAlgorithm, error: ValueError) -> bool:
    """Whether it is the numbers that an error comes from: PyTorch's distributions refuse what is not finite."""
    finite = all(bool(torch.isfinite(p).all()) for p in model.policy.parameters())
    return not finite or str(error).startswith("Expected parameter")

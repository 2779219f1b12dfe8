"""The learning curve of a training: its policy on patients set aside, again and again, and the best one kept."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm

from dms_core.errors import InputError
from dms_core.files.output_file import write_json, write_text

from ..environment import make, patient_seeds
from ..policies.learned import LearnedPolicy
from .files.model_state import save_model
from .files.records import EVALUATIONS, STATE, read_point
from .files.run_folder import RunFolder
from .settings.config import Config

Judge = Callable[[gymnasium.Env, LearnedPolicy, Sequence[int]], list[dict[str, Any]]]
"""Measures of a policy's episode with each seed, by name; "return" is one of them. What is measured is not decided
here: who starts a training gives it (evaluation/episodes/episode.py)."""


class LearningCurve:
    """Evaluations of a training so far.

    Args:
        folder: of the training.
        config: of the training.
        judge: measures episodes.
    """

    def __init__(self, folder: RunFolder, config: Config, judge: Judge) -> None:
        self.folder, self.judge = folder, judge
        self.env = make(config.environment, **config.env_kwargs)
        self.seeds = patient_seeds(config.training.eval_seed, config.training.eval_patients)
        self.evaluations = list[dict[str, Any]]()

    def restore(self, evaluations: list[dict[str, Any]]) -> None:
        """Those of a checkpoint."""
        self.evaluations = evaluations
        write_json(self.folder.path / EVALUATIONS, evaluations)

    def evaluate(self, policy: LearnedPolicy, model: BaseAlgorithm, seconds: float) -> dict[str, Any]:
        """How good a policy is on the patients set aside; the best one is kept.

        Args:
            policy: of now.
            model: that it is of, for the log and the files.
            seconds: of training so far.
        """
        measures = self.judge(self.env, policy, self.seeds)
        returns = [float(m["return"]) for m in measures]
        means = {name: _mean([m[name] for m in measures]) for name in measures[0]}
        record = {"steps": model.num_timesteps, "seconds": round(seconds, 3), **means, "returns": returns}
        for name, value in means.items():
            if value is not None:
                model.logger.record(f"evaluation/{name}", value)
        model.logger.dump(model.num_timesteps)
        if np.mean(returns) > self._best():
            self.folder.best.save(
                checkpoint_name(model.num_timesteps), lambda part: _write(part, policy, model, record)
            )
        self.evaluations.append(record)
        write_json(self.folder.path / EVALUATIONS, self.evaluations)
        return record

    def _best(self) -> float:
        """Mean return of the policy that is kept; it may be of a stretch that was lost and is trained again."""
        if self.folder.best.empty:
            return -np.inf
        try:
            return float(read_point(self.folder.best.latest())["return"])
        except InputError:
            return -np.inf


def checkpoint_name(steps: int) -> str:
    """Folder of a checkpoint; later ones sort behind."""
    return f"steps_{steps:010d}"


def _write(part: Path, policy: LearnedPolicy, model: BaseAlgorithm, record: dict[str, Any]) -> None:
    save_model(model, part)
    policy.save(part)
    write_text(part / STATE, json.dumps(record))


def _mean(values: list[Any]) -> float | None:
    """Mean of what could be measured."""
    kept = [v for v in values if np.isfinite(v)]
    return float(np.mean(kept)) if kept else None

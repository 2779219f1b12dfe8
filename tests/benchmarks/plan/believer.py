"""An estimator of the plan that goes along with a batch of worlds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from tests.benchmarks.plan.plan_episodes import EVERY
from tests.benchmarks.plan.plan_estimator import PlanEstimator


@dataclass(frozen=True)
class Belief:
    """What an estimator holds of the plan in n worlds."""

    mean: np.ndarray
    """[rad, rad/s], shape (n, 6)."""
    log_variance: np.ndarray
    """Of the normalised plan, shape (n, 6)."""
    hidden: np.ndarray
    """Its cells, shape (n, width)."""


class Believer:
    """An estimator with a state for each world; between its times it keeps what it held.

    Args:
        estimator: that sees some of the observation.
    """

    def __init__(self, estimator: PlanEstimator) -> None:
        self.estimator = estimator

    def begin(self) -> None:
        """Begin an episode in all worlds."""
        self._state: torch.Tensor | None = None
        self._step, self._belief = None, None

    def believe(self, observations: np.ndarray, begun: np.ndarray | None = None) -> Belief:
        """What is held of the plan after one more observation of each world.

        Args:
            observations: shape (n, k), with all that the estimator was trained to choose from.
            begun: worlds in which an episode begins with it, shape (n,); None: none but at the first call.
        """
        n, one = len(observations), self.estimator
        if self._step is None:
            self._step = np.zeros(n, int)
            self._state = torch.zeros(1, n, one.cells.hidden_size)
            shape = (n, one.out.out_features // 2)
            self._belief = Belief(np.zeros(shape), np.zeros(shape), np.zeros((n, one.cells.hidden_size)))
        elif begun is not None and begun.any():
            self._step[begun], self._state[:, torch.as_tensor(begun)] = 0, 0.0
        due = np.flatnonzero(self._step % EVERY == 0)
        self._step += 1
        if len(due):
            self._tell(observations, due)
        held = self._belief
        return Belief(held.mean.copy(), held.log_variance.copy(), held.hidden.copy())

    def _tell(self, observations: np.ndarray, due: np.ndarray) -> None:
        """Estimate anew in the worlds `due`."""
        one, rows = self.estimator, torch.as_tensor(due)
        seen = torch.as_tensor(observations[due][:, one.places])
        with torch.no_grad():
            mean, spread, state = one(seen[:, None], self._state[:, rows].contiguous())
            self._state[:, rows] = state
            self._belief.mean[due] = one.told(mean[:, 0], spread[:, 0])[0]
            self._belief.log_variance[due], self._belief.hidden[due] = spread[:, 0].numpy(), state[0].numpy()

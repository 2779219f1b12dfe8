"""An estimator of the plan: a GRU that tells mean and variance of each of its columns from what it sees.

Gaussian likelihood of the normalised plan over all times at which an episode goes on (Cho et al. 2014, arXiv:1406.1078,
for the cells); the state with the best likelihood of episodes that were set aside is kept.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from tests.benchmarks.plan.plan_episodes import TARGETS, Episodes

SET_ASIDE = 0.1
"""Share of the episodes that are not learned from."""
LEAST_LOG_VARIANCE = -8.0
"""Of a normalised column, so that a single sure error does not outweigh all others."""


class PlanEstimator(nn.Module):
    """The network.

    Args:
        places: components of the observation that it sees.
        width: number of cells.
        extra: numbers beside the observation that it sees.
    """

    def __init__(self, places: Sequence[int], width: int = 96, extra: int = 0) -> None:
        super().__init__()
        self.places, n = list(places), len(places) + extra
        self.cells, self.head = nn.GRU(n, width, batch_first=True), nn.Linear(width, 64)
        self.out = nn.Linear(64 + n, 2 * len(TARGETS))
        for name, size in (("seen", n), ("plan", len(TARGETS))):
            self.register_buffer(f"{name}_mean", torch.zeros(size))
            self.register_buffer(f"{name}_scale", torch.ones(size))

    def normalised(self, seen: torch.Tensor) -> torch.Tensor:
        """What the cells get, shape (n, T, k)."""
        return ((seen - self.seen_mean) / self.seen_scale).clamp(-10.0, 10.0)

    def forward(
        self, seen: torch.Tensor, state: torch.Tensor | None = None
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Mean and log-variance of the normalised plan, shape (n, T, 6) each, and the state then."""
        x = self.normalised(seen)
        h, state = self.cells(x, state)
        mean, spread = self.out(torch.cat([torch.tanh(self.head(h)), x], dim=-1)).chunk(2, dim=-1)
        return mean, spread.clamp(min=LEAST_LOG_VARIANCE, max=4.0), state

    def told(self, mean: torch.Tensor, log_variance: torch.Tensor) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation in the units of the plan [rad, rad/s]."""
        deviation = torch.exp(0.5 * log_variance) * self.plan_scale
        return (mean * self.plan_scale + self.plan_mean).numpy(), deviation.numpy()


@dataclass(frozen=True)
class Schooling:
    """How an estimator is trained."""

    epochs: int = 16
    batch: int = 50
    rate: float = 3e-3
    width: int = 96
    seed: int = 0


def inputs(episodes: Episodes, places: Sequence[int], wanted: bool = False) -> torch.Tensor:
    """What an estimator sees, shape (n, T, k); the wanted activations behind it where asked for."""
    parts = [episodes.seen[:, :, list(places)], *([episodes.wanted] if wanted else [])]
    return torch.as_tensor(np.concatenate(parts, axis=2))


def train(
    episodes: Episodes, places: Sequence[int], how: Schooling, wanted: bool = False, begin: PlanEstimator | None = None
) -> PlanEstimator:
    """A trained estimator, from scratch or from one that knows something already."""
    torch.manual_seed(how.seed)
    seen, plan = inputs(episodes, places, wanted), torch.as_tensor(episodes.plan)
    counted = torch.as_tensor(episodes.running, dtype=torch.float32)
    order = torch.randperm(len(seen))
    aside, learned = order[: round(SET_ASIDE * len(seen))], order[round(SET_ASIDE * len(seen)) :]
    one = begin or PlanEstimator(places, how.width, seen.shape[2] - len(places))
    if begin is None:
        _normalise(one, seen[learned], plan[learned], counted[learned] > 0)
    target = (plan - one.plan_mean) / one.plan_scale
    adam = torch.optim.AdamW(one.parameters(), lr=how.rate, weight_decay=1e-3)
    steps = how.epochs * -(-len(learned) // how.batch)
    falling = torch.optim.lr_scheduler.OneCycleLR(adam, how.rate, total_steps=steps, pct_start=0.1)
    best, kept, began = np.inf, None, time.perf_counter()
    for epoch in range(how.epochs):
        for rows in learned[torch.randperm(len(learned))].split(how.batch):
            loss = _loss(one, seen[rows], target[rows], counted[rows])
            adam.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(one.parameters(), 1.0)
            adam.step()
            falling.step()
        with torch.no_grad():
            now = float(_loss(one, seen[aside], target[aside], counted[aside]))
        if now < best:
            best, kept = now, {name: x.clone() for name, x in one.state_dict().items()}
        seconds = time.perf_counter() - began
        print(f"epoch {epoch} loss {loss.item():.3f} set aside {now:.3f} best {best:.3f} {seconds:.0f} s", flush=True)
    assert kept is not None
    one.load_state_dict(kept)
    return one


def tell(one: PlanEstimator, episodes: Episodes, wanted: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of the plan at all times, shape (n, T, 6) each."""
    with torch.no_grad():
        mean, spread, _ = one(inputs(episodes, one.places, wanted))
        return one.told(mean, spread)


def _normalise(one: PlanEstimator, seen: torch.Tensor, plan: torch.Tensor, counted: torch.Tensor) -> None:
    """Set the scales of an estimator; what does not vary is let be."""
    for name, values in (("seen", seen[counted]), ("plan", plan[counted])):
        scale = values.std(dim=0)
        getattr(one, f"{name}_mean").copy_(values.mean(dim=0))
        getattr(one, f"{name}_scale").copy_(torch.where(scale > 1e-6, scale, torch.ones_like(scale)))


def _loss(one: PlanEstimator, seen: torch.Tensor, target: torch.Tensor, counted: torch.Tensor) -> torch.Tensor:
    """Mean negative log-likelihood, without its constant."""
    mean, spread, _ = one(seen)
    each = 0.5 * (spread + (target - mean) ** 2 * torch.exp(-spread)).mean(dim=-1)
    return (each * counted).sum() / counted.sum()

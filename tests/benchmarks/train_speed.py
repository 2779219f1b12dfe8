"""PPO end to end: frames a second with the compiled batch, and with Stable-Baselines3's usual DummyVecEnv.

    OMP_NUM_THREADS=1 python tests/benchmarks/train_speed.py

Both train configs/agents/ppo.yml (policy, n_envs, n_steps, batch, epochs, normalisation) with PyTorch on one thread;
only the environments differ: ElbowLiftVecEnv, as `python -m agents train` uses it, on one thread and on two, or
DummyVecEnv of ElbowLiftEnv, one after the other in Python. Wall seconds of whole rollouts with their updates, scaled by
calibration.py, for which the machine has to be quiet; the first rollout of each is not timed. target_kl is taken out,
so that each update does all its epochs.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecMonitor, VecNormalize

from agents.training.learners.algorithms import build
from agents.training.settings.config import Config
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.envs.elbow_lift_sb3 import ElbowLiftVecEnv
from tests.benchmarks import csv_file
from tests.benchmarks.calibration import LUMP_MS, lump

CONFIG = Path(__file__).parents[2] / "configs" / "agents" / "ppo.yml"
Row = tuple[str, float, float, float]
"""Environments, frames a second, shares of the time of rollout and update."""


class Clock(BaseCallback):
    """Normalised wall seconds of rollouts and of updates, from the second rollout on.

    Args:
        frames: of a rollout.
    """

    def __init__(self, frames: int) -> None:
        super().__init__()
        self.frames, self.rollout, self.update = frames, 0.0, 0.0
        self.lump, self.mark = lump(), time.perf_counter()

    def _since(self) -> float:
        """Seconds since the last call."""
        used, before, self.lump = time.perf_counter() - self.mark, self.lump, lump()
        self.mark = time.perf_counter()
        return used * LUMP_MS / (0.5 * (before + self.lump)) if self.num_timesteps > self.frames else 0.0

    def _on_rollout_start(self) -> None:
        self.update += self._since()

    def _on_rollout_end(self) -> None:
        self.rollout += self._since()

    def _on_training_end(self) -> None:
        self.update += self._since()

    def _on_step(self) -> bool:
        return True


def compiled(config: Config, threads: int) -> VecEnv:
    """One batch."""
    return VecMonitor(ElbowLiftVecEnv(config.n_envs, threads=threads, **config.env_kwargs))


def usual(config: Config) -> VecEnv:
    """Single environments in a row."""
    return VecMonitor(DummyVecEnv([lambda: ElbowLiftEnv(**config.env_kwargs)] * config.n_envs))


def frames_per_second(config: Config, worlds: VecEnv, rollouts: int) -> tuple[float, float, float]:
    """(frames a normalised second, share of the rollouts in the time, that of the updates)."""
    worlds.seed(0)
    model = build(config, worlds if config.normalize is None else VecNormalize(worlds, **config.normalize), 0)
    frames = config.n_envs * config.arguments["n_steps"]
    clock = Clock(frames)
    model.learn((1 + rollouts) * frames, callback=clock)
    worlds.close()
    seconds = clock.rollout + clock.update
    return rollouts * frames / seconds, clock.rollout / seconds, clock.update / seconds


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rollouts", type=int, default=2, help="that are timed of each")
    parser.add_argument("--set", nargs="*", default=[], metavar="KEY=VALUE", help="changes of the configuration")
    parser.add_argument("--out", type=Path, help="a CSV of the table")
    given = parser.parse_args(arguments)
    torch.set_num_threads(1)
    config = Config.read(CONFIG, [*given.set, "target_kl=null"])
    kinds: dict[str, Callable[[], VecEnv]] = {
        "DummyVecEnv of ElbowLiftEnv": lambda: usual(config),
        "ElbowLiftVecEnv, 1 thread": lambda: compiled(config, 1),
        "ElbowLiftVecEnv, 2 threads": lambda: compiled(config, 2),
    }
    settings = f"{config.n_envs} environments, n_steps {config.arguments['n_steps']}"
    print(f"PPO, {settings}, {config.arguments.get('n_epochs', 10)} epochs; wall time")
    print(f"{'environments':28} {'frames/s':>9} {'rollout':>8} {'update':>7} {'ratio':>6}")
    rows: list[Row] = []
    for name, make in kinds.items():
        rate, rollout, update = frames_per_second(config, make(), given.rollouts)
        rows.append((name, rate, rollout, update))
        print(f"{name:28} {rate:9.0f} {rollout:8.0%} {update:7.0%} {rate / rows[0][1]:6.2f}", flush=True)
    if given.out:
        csv_file.write(given.out, ("environments", "frames_per_s", "rollout_share", "update_share"), rows)


if __name__ == "__main__":
    main()

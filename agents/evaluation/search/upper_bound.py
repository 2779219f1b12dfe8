r"""What could be reached: for each patient the best of many schedules that know the patient.

A schedule is the device's PID with an authority and a setpoint below the reference, one pair until the arm is up and
another one after, in every repetition the same. All schedules are tried on the same episode in one batch, and the best
is picked with hindsight, which no policy has; beside it stands the schedule that is best for all patients together. It
leaves out schedules that change more often, setpoints above the reference and antagonist ropes; what any device could
recruit with errors of that size is estimated (recruitment.py). What an episode of fewer repetitions gives is known from
the same run, since an episode goes on as a shorter one ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from dms_core.errors import InputError, SimulationError, choices
from exo_env.tasks.movements.repetition import MOVED, Repetition, Repetitions
from exo_env.world.episodes.episode import Episode

from ...environment import ENVIRONMENT, make_vector, patient_seeds
from .recruitment import most_recruited

TRIES = 96
LARGEST_LAG = 3.0
"""[deg]"""
MORE_ERROR = 1.0
"""By which the tracking error may be larger than that of the PID, where the least help is looked for [deg]."""


def schedules(generator: np.random.Generator) -> np.ndarray:
    """Authority [-] and lag [deg] until the arm is up, then after it, shape (TRIES, 4); the first is the plain PID."""
    tried = generator.uniform((0.05, 0.0, 0.05, 0.0), (1.0, LARGEST_LAG, 1.0, LARGEST_LAG), (TRIES, 4))
    tried[0] = (1.0, 0.0, 1.0, 0.0)
    lags = np.linspace(0.5, LARGEST_LAG, 6)
    tried[1:7] = np.stack([np.ones(6), lags, np.ones(6), lags], axis=1)
    tried[7:13] = np.stack([np.ones(6), lags, np.ones(6), np.zeros(6)], axis=1)
    return tried


@dataclass
class Tried:
    """Sums over each repetition of one patient's episode, by schedule: shape (repetitions, TRIES)."""

    seed: int
    ability: float
    returns: np.ndarray
    square: np.ndarray
    """Sum of the squared tracking error [deg^2]."""
    works: np.ndarray
    """Positive, of device and patient [W]; shape (2, repetitions, TRIES)."""
    effort: np.ndarray
    steps: int
    """In a repetition."""
    episode: Episode
    error: np.ndarray
    """psi - theta of the PID at the control times [rad]."""

    def row(self, shared: int, n: int) -> dict[str, float]:
        """What is written of the first n repetitions, efforts of the last one; `shared` is the best schedule of all.

        `least_share` is the least of the schedules with an error of at most MORE_ERROR above the PID's, `linear_share`
        what would be left if such errors recruited as much as they can and every bit of effort became work.
        """
        returns, works = self.returns[:n].sum(axis=0), self.works[:, :n].sum(axis=1)
        share, rms = works[0] / works.sum(axis=0), np.sqrt(self.square[:n].mean(axis=0) / self.steps)
        best, effort = int(np.argmax(returns)), self.effort[n - 1] / self.steps
        least = share[rms <= rms[0] + MORE_ERROR].min()
        errors = self.error[: n * self.steps], np.radians(rms[0] + MORE_ERROR)
        linear = share[0] - most_recruited(self.episode, *errors) / (works[:, 0].sum() * self.episode.times[1])
        return {
            "seed": self.seed, "ability": self.ability, "repetitions": n, "pid_return": returns[0],
            "shared_return": returns[shared], "best_return": returns[best], "pid_share": share[0],
            "shared_share": share[shared], "best_share": share[best], "least_share": least,
            "linear_share": max(linear, 0.0), "pid_rms_deg": rms[0], "best_rms_deg": rms[best],
            "pid_effort": effort[0], "best_effort": effort[best],
        }  # fmt: skip


NEEDS = ("tracking_error", "exo_moment", "exo_angle.rate", "muscle_moment", "elbow_angle.rate", "effort")
"""Readings without which there is no upper bound."""


def upper_bound(
    population: str,
    patients: int,
    seed: int,
    *,
    repetitions: int = 1,
    environment: str = ENVIRONMENT,
    progress: Callable[[Tried], object] = lambda one: None,
    **settings: Any,
) -> tuple[list[Tried], np.ndarray]:
    """Try schedules on each patient.

    Args:
        population: of the patients, by name or YAML file.
        patients: how many.
        seed: of the patients.
        repetitions: of the movement in an episode.
        environment: its id; one with a PID and a reference.
        progress: called with what came of each patient.
        settings: further ones of the environment.

    Returns:
        What came of each patient, and the schedules, shape (TRIES, 4).

    Raises:
        InputError: the environment lacks a reading that is needed, or its movement is no repetition.
    """
    worlds = make_vector(
        environment, TRIES, action_mode="pid_setpoint", patient=population, repetitions=repetitions,
        autoreset_mode="Disabled", **settings,
    )  # fmt: skip
    tried, results = schedules(np.random.default_rng(seed)), []
    for one in patient_seeds(seed, patients):
        results.append(tried_on(worlds, one, tried, repetitions))
        progress(results[-1])
    worlds.close()
    return results, tried


def best_together(results: list[Tried], n: int) -> int:
    """The schedule that is best for all patients in the first n repetitions."""
    return int(np.argmax(np.sum([one.returns[:n].sum(axis=0) for one in results], axis=0)))


def tried_on(worlds: Any, seed: int, tried: np.ndarray, n: int = 1) -> Tried:
    """All schedules on one patient.

    Args:
        worlds: the vector environment, a world a schedule.
        seed: of the patient.
        tried: the schedules, shape (TRIES, 4).
        n: repetitions of the movement in an episode.
    """
    _, drawn = worlds.reset(seed=[seed] * worlds.num_envs)
    envs = worlds.envs
    lacking = [name for name in NEEDS if name not in envs[0].readings()]
    lacking += ["reference"] if "reference" not in drawn else []
    if lacking:
        raise InputError(f"an upper bound needs readings that this environment does not have: {choices(lacking)}.")
    if not isinstance(envs[0].movement, Repetitions):
        kind = type(envs[0].movement).__name__
        raise InputError(f"an upper bound needs a movement of Repetitions; that of this environment is {kind}.")
    episode, period = envs[0].episode, envs[0].period
    numbers: dict[str, Any] = {name: float(drawn["reference"][name][0]) for name in MOVED}
    movement = Repetition(**numbers)
    times = episode.times[:-1]
    shape, up, steps = (n, TRIES), movement.rest + movement.duration, len(times) // n
    sums = Tried(
        seed, float(drawn["ability"][0]), np.zeros(shape), np.zeros(shape), np.zeros((2, *shape)), np.zeros(shape),
        steps, episode, np.zeros(len(times)),
    )  # fmt: skip
    for step, time in enumerate(times):
        k = min(step // steps, n - 1)
        authority, lag = tried[:, 0:2].T if time - k * steps * period < up else tried[:, 2:4].T
        actions = np.stack([-np.radians(lag) / envs[0].drive.setpoint_range, 2.0 * authority - 1.0], axis=1)
        sums.error[step] = -envs[0].readings()["tracking_error"]
        _, rewards, terminated, _, infos = worlds.step(actions)
        if terminated.any():
            raise SimulationError(f"a schedule ended the episode of seed {seed} at {time:.2f} s; none should.")
        readings = [env.readings() for env in envs]
        error, device, hinge, muscles, rate, effort = (np.array([r[name] for r in readings]) for name in NEEDS)
        sums.returns[k] += rewards
        sums.square[k] += np.degrees(error) ** 2
        sums.effort[k] += effort
        sums.works[0, k] += np.maximum(device * hinge, 0.0)
        sums.works[1, k] += np.maximum(muscles * rate, 0.0)
    return sums

r"""What could be reached: for each patient the best of many schedules that know the patient.

    python -m agents.evaluation.upper_bound --population evaluation --patients 24 --repetitions 4 --seed 0 \\
        --out docs/ceiling.csv

A schedule is the device's PID with an authority and a setpoint below the reference, one pair until the arm is up and
another one after, in every repetition the same. All schedules are tried on the same episode in one batch, and the best
is picked with hindsight, which no policy has; beside it stands the schedule that is best for all patients together. It
leaves out schedules that change more often, setpoints above the reference and antagonist ropes; what any device could
recruit with errors of that size is estimated (recruitment.py). What an episode of fewer repetitions gives is known from
the same run, since an episode goes on as a shorter one ends.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from tqdm import tqdm

from agents.evaluation.evaluate import check_numbers, patient_seeds
from agents.evaluation.recruitment import most_recruited
from dms_core.errors import SimulationError
from dms_core.output_file import check_writable, whole_file
from exo_env.drives.drive import PidSetpoint
from exo_env.envs.vector_env import ElbowLiftVectorEnv
from exo_env.world.control_period import READING
from exo_env.world.episode import Episode

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
    """Of the tracking error [deg^2]."""
    works: np.ndarray
    """Positive, of device and patient [W]; shape (2, repetitions, TRIES)."""
    effort: np.ndarray
    steps: int
    """In a repetition."""
    episode: Episode
    error: np.ndarray
    """psi - theta of the PID at the control times [rad]."""

    def row(self, shared: int, n: int) -> dict[str, float]:
        """Of the first n repetitions, efforts of the last one; `shared` is the best schedule of all patients.

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


def tried_on(worlds: ElbowLiftVectorEnv, seed: int, tried: np.ndarray) -> Tried:
    """All schedules on one patient."""
    worlds.reset(seed=[seed] * worlds.num_envs)
    episode, period = worlds.envs[0].episode, worlds.envs[0].period
    movement, times = episode.repetition, episode.times[:-1]
    n = movement.count
    shape, up, steps = (n, TRIES), movement.rest + movement.duration, len(times) // n
    found = Tried(
        seed, episode.need.ability, np.zeros(shape), np.zeros(shape), np.zeros((2, *shape)), np.zeros(shape), steps,
        episode, np.zeros(len(times)),
    )  # fmt: skip
    for step, time in enumerate(times):
        k = min(step // steps, n - 1)
        authority, lag = tried[:, 0:2].T if time - k * steps * period < up else tried[:, 2:4].T
        actions = np.stack([-np.radians(lag) / PidSetpoint().setpoint_range, 2.0 * authority - 1.0], axis=1)
        found.error[step] = -worlds.envs[0].packed.values.reading[READING.error]
        _, rewards, terminated, _, told = worlds.step(actions)
        if terminated.any():
            raise SimulationError(f"a schedule ended the episode of seed {seed} at {time:.2f} s; none should.")
        r = np.array([env.packed.values.reading for env in worlds.envs])
        found.returns[k] += rewards
        found.square[k] += told["tracking_error_deg"] ** 2
        found.effort[k] += told["effort"]
        found.works[0, k] += np.maximum(r[:, READING.exo_moment] * r[:, READING.hinge_rate], 0.0)
        found.works[1, k] += np.maximum(r[:, READING.muscle_moment] * r[:, READING.rate], 0.0)
    return found


def ceiling(out: Path, population: str = "evaluation", patients: int = 24, repetitions: int = 1, seed: int = 0) -> None:
    """Try schedules on each patient and write a table.

    Args:
        out: CSV file.
        population: of the patients, by name or YAML file.
        patients: how many.
        repetitions: of the movement in an episode.
        seed: of the patients.
    """
    check_numbers(patients, seed)
    check_writable(out)
    worlds = ElbowLiftVectorEnv(
        TRIES, action_mode="pid_setpoint", patient=population, repetitions=repetitions, autoreset_mode="Disabled"
    )
    tried = schedules(np.random.default_rng(seed))
    seeds = tqdm(patient_seeds(seed, patients), unit="patient", disable=None)
    found = [tried_on(worlds, one, tried) for one in seeds]
    worlds.close()
    counts = range(1, repetitions + 1)
    shared = [int(np.argmax(np.sum([one.returns[:n].sum(axis=0) for one in found], axis=0))) for n in counts]
    rows = [one.row(best, n) for one in found for n, best in zip(counts, shared, strict=True)]
    options = f"--population {population} --patients {patients} --repetitions {repetitions} --seed {seed}"
    with whole_file(out) as file:
        file.write(f"# python -m agents.evaluation.upper_bound {options}\n")
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        whole = ("seed", "repetitions")
        writer.writerows({k: v if k in whole else f"{v:.4g}" for k, v in row.items()} for row in rows)
    for n, best in zip(counts, shared, strict=True):
        means = {
            c: float(np.mean([row[c] for row in rows if row["repetitions"] == n]))
            for c in rows[0]
            if c not in ("seed", "ability", "repetitions")
        }
        print(f"{patients} patients of '{population}', {n} repetitions, shared schedule {tried[best].round(2)}, means:")
        print("  " + ", ".join(f"{k} {v:.3g}" for k, v in means.items()))


if __name__ == "__main__":
    tyro.cli(ceiling)

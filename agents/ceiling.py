"""What could be reached: for each patient the best of many schedules that know the patient.

    python -m agents.ceiling --population evaluation --patients 24 --seed 0 --out docs/ceiling.csv

A schedule is the device's PID with an authority and a setpoint below the reference, one pair until the arm is up and
another one after. All schedules are tried on the same episode in one batch, and the best is picked with hindsight,
which no policy has. It leaves out schedules that change more often, setpoints above the reference and antagonist ropes.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import tyro
from tqdm import tqdm

from agents.evaluate import patient_seeds
from dms_core.errors import SimulationError
from dms_core.output_file import check_writable, whole_file
from exo_env.actions import PidSetpoint
from exo_env.control_period import READING
from exo_env.vector_env import ElbowLiftVectorEnv

TRIES = 96
LARGEST_LAG = 3.0
"""[deg]"""
MORE_ERROR = 1.0
"""By which the tracking error may be larger than that of the PID, where the least help is looked for [deg]."""
COLUMNS = ("seed", "ability", "pid_return", "best_return", "pid_share", "best_share", "best_rms_deg", "least_share")


def schedules(generator: np.random.Generator) -> np.ndarray:
    """Authority [-] and lag [deg] until the arm is up, then after it, shape (TRIES, 4); the first is the plain PID."""
    tried = generator.uniform((0.05, 0.0, 0.05, 0.0), (1.0, LARGEST_LAG, 1.0, LARGEST_LAG), (TRIES, 4))
    tried[0] = (1.0, 0.0, 1.0, 0.0)
    return tried


def tried_on(worlds: ElbowLiftVectorEnv, seed: int, tried: np.ndarray) -> dict[str, float]:
    """The best of the schedules on one patient."""
    worlds.reset(seed=[seed] * worlds.num_envs)
    episode = worlds.envs[0].episode
    up = episode.repetition.rest + episode.repetition.duration
    returns, square, works, alive = np.zeros(TRIES), np.zeros(TRIES), np.zeros((2, TRIES)), np.ones(TRIES, bool)
    for time in episode.times[:-1]:
        authority, lag = tried[:, 0:2].T if time < up else tried[:, 2:4].T
        actions = np.stack([-np.radians(lag) / PidSetpoint().setpoint_range, 2.0 * authority - 1.0], axis=1)
        _, rewards, terminated, _, told = worlds.step(actions)
        returns += np.where(alive, rewards, 0.0)
        square += told["tracking_error_deg"] ** 2
        r = np.array([env.packed.values.reading for env in worlds.envs])
        works[0] += np.maximum(r[:, READING.exo_moment] * r[:, READING.hinge_rate], 0.0)
        works[1] += np.maximum(r[:, READING.muscle_moment] * r[:, READING.rate], 0.0)
        alive &= ~terminated
        if not alive.all():
            raise SimulationError(f"a schedule ended the episode of seed {seed} at {time:.2f} s; none should.")
    share, rms = works[0] / works.sum(axis=0), np.sqrt(square / (len(episode.times) - 1))
    best = int(np.argmax(np.where(alive, returns, -np.inf)))
    least = share[alive & (rms <= rms[0] + MORE_ERROR)].min()
    return dict(zip(COLUMNS, (seed, episode.need.ability, returns[0], returns[best], share[0], share[best], rms[best],
                              least), strict=True))  # fmt: skip


def ceiling(out: Path, population: str = "evaluation", patients: int = 24, seed: int = 0) -> None:
    """Try schedules on each patient and write a table.

    Args:
        out: CSV file.
        population: of the patients, by name or YAML file.
        patients: how many.
        seed: of the patients.
    """
    check_writable(out)
    worlds = ElbowLiftVectorEnv(TRIES, action_mode="pid_setpoint", patient=population, autoreset_mode="Disabled")
    tried = schedules(np.random.default_rng(seed))
    rows = [tried_on(worlds, one, tried) for one in tqdm(patient_seeds(seed, patients), unit="patient", disable=None)]
    worlds.close()
    with whole_file(out) as file:
        file.write(f"# python -m agents.ceiling --population {population} --patients {patients} --seed {seed}\n")
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows({k: v if k == "seed" else f"{v:.4g}" for k, v in row.items()} for row in rows)
    means = {name: float(np.mean([row[name] for row in rows])) for name in COLUMNS[1:]}
    print(f"{patients} patients of '{population}', means: " + ", ".join(f"{k} {v:.3g}" for k, v in means.items()))


if __name__ == "__main__":
    tyro.cli(ceiling)

"""What the group `estimated` is worth: the second table of docs/elbow-estimation.md.

    python -m tests.benchmarks.estimated_group --patients 50 --out docs/elbow_estimated.csv

Patients of `evaluation` in a device that adaptive gravity compensation commands, 50 times a second. Estimates are what
the environment shows, truth is what its readings and sensors say; seeds are those of tests/benchmarks/estimation.py.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import gymnasium
import numpy as np

import exo_env  # noqa: F401  (registers the environments)
from agents.policies.reference_free.adaptive_gravity import AdaptiveGravity
from dms_core.files.output_file import write_csv
from tests.benchmarks.estimation import FIRST_SEED, SETTLING, Recording, Score, note

ENVIRONMENTS = ("exo/HiddenIntent-v0", "exo/ElbowLift-v2")
QUANTITIES = ("others_moment", "muscle_moment", "load")


def episode(env, seed: int) -> tuple[dict[str, np.ndarray], np.ndarray]:  # noqa: ANN001
    """Truth by quantity, and at each time each estimate with its deviation, shape (n, 3, 2)."""
    policy, found, rows, over = AdaptiveGravity(), Recording(), [], False
    observation, _ = env.reset(seed=seed)
    policy.reset(env)
    while not over:
        observation, _, ended, cut, _ = env.step(policy(observation, {}))
        over = ended or cut
        note(env, observation, found)
        read = env.readout.number
        rows.append([[read(f"estimated_{q}"), read(f"estimated_{q}_deviation")] for q in QUANTITIES])
    truth = (found.others, found.muscles, found.load)
    return {q: np.array(x) for q, x in zip(QUANTITIES, truth, strict=True)}, np.array(rows)


def scores(environment: str, population: str, patients: int) -> dict[str, Score]:
    """Scores of each quantity over patients."""
    env = gymnasium.make(
        environment, patient=population, observation=("device", "estimated"), action_mode="assist_moment",
        disable_env_checker=True,
    ).unwrapped  # fmt: skip
    found = {q: Score() for q in QUANTITIES}
    late = round(SETTLING / env.period)
    for k in range(patients):
        truth, rows = episode(env, FIRST_SEED + k)
        for i, (q, score) in enumerate(found.items()):
            score.add(rows[late:, i, 0], truth[q][late:], rows[late:, i, 1])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--patients", type=int, default=50)
    parser.add_argument("--population", default="evaluation")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    rows = []
    for environment in ENVIRONMENTS:
        for q, score in scores(environment, given.population, given.patients).items():
            rows.append(score.row())
            print(environment, q, {k: round(v, 4) for k, v in rows[-1].items()}, flush=True)
    # The load is in kg, whose columns are called what those of moments are.
    heads = {name: name.removesuffix("_Nm") for name in rows[0]}
    columns = {new: np.array([row[old] for row in rows]) for old, new in heads.items()}
    write_csv(given.out, {"row": np.arange(1.0, len(rows) + 1.0), **columns})


if __name__ == "__main__":
    main()

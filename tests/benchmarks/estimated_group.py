"""What the group `estimated` is worth: the second table of docs/elbow-estimation.md.

    python -m tests.benchmarks.estimated_group --patients 50 --out docs/elbow_estimated.csv

Patients of `evaluation` in a device that adaptive gravity compensation commands, 50 times a second. Estimates are what
the environment shows, truth is what its readings and sensors say; seeds are those of tests/benchmarks/estimation.py.
Beside them the same filter with a constant for the load shows what its load is worth.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import exo_env  # noqa: F401  (registers the environments)
from agents.policies.reference_free.adaptive_gravity import AdaptiveGravity
from dms_core.files.output_file import write_csv
from exo_env.estimation.reduced_elbow import ReducedTuning
from exo_env.estimation.reduced_filter import ESTIMATE, NUMBERS, begin_estimates, step_estimates
from tests.benchmarks.estimation import FIRST_SEED, SETTLING, Recording, Score, note

ENVIRONMENTS = ("exo/HiddenIntent-v0", "exo/ElbowLift-v2")
QUANTITIES = ("others_moment", "muscle_moment", "load")
CONSTANT = ("muscle_moment", "load")
"""Those that are estimated with a constant load, too."""
ROWS = (*QUANTITIES, *(f"{q}, constant load" for q in CONSTANT))


class ConstantLoad:
    """The filter of an environment with the mean of its prior in place of the load that it estimates."""

    def __init__(self, env) -> None:  # noqa: ANN001
        tables, prior = env.world.tables.estimator, ReducedTuning()
        numbers = tables.numbers.copy()
        numbers[NUMBERS.load_by_left], numbers[NUMBERS.load_deviation] = 0.0, prior.load_deviation
        self.sensed, self.out = tables.sensed, np.zeros_like(tables.estimates)
        belief = (np.zeros_like(x) for x in (tables.mean, tables.fast, tables.slow, tables.learnt))
        self.arrays = (tables.sensed, numbers, tables.curves, tables.disturbance, *belief, self.out)
        begin_estimates(*self.arrays)

    def step(self) -> list[list[float]]:
        """Estimate and deviation of each quantity behind the present readings."""
        step_estimates(*self.arrays)
        places = [ESTIMATE._fields.index(q) for q in CONSTANT]
        return [[self.out[k], self.out[k + 1]] for k in places]


def episode(env, seed: int) -> tuple[dict[str, np.ndarray], np.ndarray]:  # noqa: ANN001
    """Truth by quantity, and at each time what is estimated with its deviation, shape (n, rows, 2)."""
    policy, found, rows, over = AdaptiveGravity(), Recording(), [], False
    observation, _ = env.reset(seed=seed)
    constant = ConstantLoad(env)
    policy.reset(env)
    while not over:
        observation, _, ended, cut, _ = env.step(policy(observation, {}))
        over = ended or cut
        note(env, observation, found)
        read = env.readout.number
        shown = [[read(f"estimated_{q}"), read(f"estimated_{q}_deviation")] for q in QUANTITIES]
        rows.append([*shown, *constant.step()])
    truth = (found.others, found.muscles, found.load)
    return {q: np.array(x) for q, x in zip(QUANTITIES, truth, strict=True)}, np.array(rows)


def scores(environment: str, population: str, patients: int, settings: Mapping[str, Any]) -> dict[str, Score]:
    """Scores of each row over patients, under settings of the environment."""
    env = gymnasium.make(
        environment, patient=population, observation=("device", "estimated"), action_mode="assist_moment",
        disable_env_checker=True, **settings,
    ).unwrapped  # fmt: skip
    found = {name: Score() for name in ROWS}
    late = round(SETTLING / env.period)
    for k in range(patients):
        truth, rows = episode(env, FIRST_SEED + k)
        for i, (name, score) in enumerate(found.items()):
            score.add(rows[late:, i, 0], truth[name.partition(",")[0]][late:], rows[late:, i, 1])
    return found


def spread(score: Score) -> dict[str, float]:
    """How often intervals of 95 % hold of single patients: the least, and that which a tenth of them falls short of."""
    each = [np.mean(x) for x in score.within]
    return {"coverage_least_patient": float(min(each)), "coverage_tenth_patient": float(np.quantile(each, 0.1))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--patients", type=int, default=50)
    parser.add_argument("--population", default="evaluation")
    parser.add_argument("--settings", type=json.loads, default={}, help="of the environments, JSON")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    rows = []
    for environment in ENVIRONMENTS:
        for q, score in scores(environment, given.population, given.patients, given.settings).items():
            rows.append(score.row() | spread(score))
            print(environment, q, {k: round(v, 4) for k, v in rows[-1].items()}, flush=True)
    # The load is in kg, whose columns are called what those of moments are.
    heads = {name: name.removesuffix("_Nm") for name in rows[0]}
    columns = {new: np.array([row[old] for row in rows]) for old, new in heads.items()}
    write_csv(given.out, {"row": np.arange(1.0, len(rows) + 1.0), **columns})


if __name__ == "__main__":
    main()

"""Patients alone at several gains of feedback, as it is felt and as it is predicted: who ends unsafe, who keeps up.

A gain on what is felt late makes the arm swing; with a forward model (excitation/forward_model.py) it is steady.
Other traits are those that each patient has drawn. An elbow that ends below the lowest angle allowed counts apart.

    python -m exo_env.paper.feedback_gains > docs/feedback_gains.csv
"""

from __future__ import annotations

import csv
import math
import sys

import numpy as np
from tqdm import tqdm

from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.tables import FELT

POPULATIONS = ("mixed", "evaluation")
GAINS = (0.0, 0.5, 1.5, 3.0)
"""Gains of feedback [1/rad]."""
WAYS = {
    "felt": {"prediction": 0.0, "feedback_lead": 0.0},
    "felt, with rate": {"prediction": 0.0, "feedback_lead": 0.05},
    "predicted": {"prediction": 1.0, "feedback_lead": 0.0},
    "predicted, with rate": {"prediction": 1.0, "feedback_lead": 0.05},
}
PATIENTS, SEED = 60, 1
ALONE = np.array([-1.0, -1.0])
"""Action of a device that pulls no rope."""


def alone(population: str, patients: int, seed: int, **changed: float) -> dict[str, float]:
    """What becomes of patients without help: shares that end unsafe [-], mean error [deg], unsteadiness [rad/s^3].

    Args:
        population: name of the population.
        patients: how many.
        seed: seed of the first; the others follow.
        changed: traits that all have in common.
    """
    env = ElbowLiftEnv(patient=population, noise=False)
    straight, otherwise, errors, jerks = 0, 0, [], []
    for k in range(patients):
        info = env.reset(seed=1000 * seed + k)[1]
        env.reset(seed=1000 * seed + k, options={"patient": {**info["patient"], **changed}})
        over, error, angles = False, [], []
        while not over:
            *_, terminated, truncated, info = env.step(ALONE)
            error.append(abs(info["tracking_error_deg"]))
            angles.append(float(env.world.tables.patient.felt[FELT.angle]))
            over = terminated or truncated
        straight += terminated and angles[-1] < math.radians(env.limits.lowest_deg)
        otherwise += terminated and angles[-1] >= math.radians(env.limits.lowest_deg)
        errors.append(np.mean(error))
        if len(angles) > 50:
            jerks.append(math.sqrt(np.mean(np.diff(angles, 3) ** 2)) / env.period**3)
    return {
        "straight": straight / patients,
        "otherwise_unsafe": otherwise / patients,
        "error_deg": float(np.mean(errors)),
        "jerk": float(np.median(jerks)) if jerks else math.nan,
    }


def main() -> None:
    """Write the table."""
    writer = None
    cases = [(p, g, w) for p in POPULATIONS for g in GAINS for w in WAYS if g > 0.0 or w == "felt"]
    for population, gain, way in tqdm(cases, unit="row", disable=None):
        found = alone(population, PATIENTS, SEED, feedback_gain=gain, **WAYS[way])
        row = {"population": population, "gain": f"{gain:g}", "feedback": way if gain > 0.0 else "none"}
        row |= {name: f"{x:.3g}" for name, x in found.items()}
        if writer is None:
            writer = csv.DictWriter(sys.stdout, row, lineterminator="\n")
            writer.writeheader()
        writer.writerow(row)


if __name__ == "__main__":
    main()

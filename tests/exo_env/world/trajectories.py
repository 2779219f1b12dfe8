"""Short trajectories that must stay what they are: `python -m tests.exo_env.world.trajectories` renews the file.

It is renewed only together with a line in CHANGELOG.md that says what changed physics, rewards or draws.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from exo_env.envs.elbow_lift import ElbowLiftEnv

FILE = Path(__file__).with_name("trajectories.csv")
CASES = {
    "rope tension": {"patient": "mixed"},
    "setpoint of the PID": {"patient": "evaluation", "action_mode": "pid_setpoint"},
    "two repetitions": {"patient": "stroke_severe", "action_mode": "pid_setpoint", "repetitions": 2},
    "200 Hz, no noise": {"patient": "healthy", "control_rate": 200.0, "noise": False},
    "assist moment": {"patient": "mixed", "action_mode": "assist_moment"},
    "impedance": {"patient": "evaluation", "action_mode": "impedance"},
}
FIRST = {
    "rope_tension": [-0.4, -0.8], "pid_setpoint": [-0.4, -0.8], "assist_moment": [0.2, -0.8],
    "impedance": [-0.4, -0.8, 0.0],
}  # fmt: skip
"""First action in each mode."""
STEPS, EVERY = 30, 5
COLUMNS = ("elbow_angle.angle", "elbow_angle.rate", "muscle_moment", "exo_moment", "elbow_reaction", "effort")


def rows() -> list[dict[str, str]]:
    """Readings and summed reward of each case, every few control periods, under drawn actions."""
    table = []
    for number, (case, settings) in enumerate(CASES.items()):
        env, actions = ElbowLiftEnv(**settings), np.random.default_rng(number)
        observation, info = env.reset(seed=number)
        action, total = np.array(FIRST[env.action_mode]), 0.0
        for k in range(STEPS + 1):
            if k % EVERY == 0:
                r = env.readings()
                values = [*(r[name] for name in COLUMNS), total, float(observation.sum()), info["load"]]
                names = (*COLUMNS, "return", "observation", "load")
                table.append(
                    {"case": case, "step": str(k)} | {n: f"{x:.9g}" for n, x in zip(names, values, strict=True)}
                )
            action = np.clip(action + 0.1 * actions.normal(size=env.actions), -1.0, 1.0)
            observation, reward, *_ = env.step(action)
            total += reward
    return table


if __name__ == "__main__":
    found = rows()
    with FILE.open("w", newline="") as file:
        writer = csv.DictWriter(file, found[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)
    print(f"written: {FILE}")

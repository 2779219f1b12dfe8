"""Physics, rewards, observations and draws are those of the last release; trajectories.py says how they are renewed."""

import csv

import numpy as np

from tests.exo_env.world.trajectories import CASES, COLUMNS, FILE, rows

# Other processors round otherwise, and a step that is halved for it differs by the solver's own error: 1e-3 rad of the
# elbow in the worst case. A change of physics, of a patient or of a reward is a hundred times that.
TOLERANCE = {
    "elbow_angle.angle": 1e-3, "elbow_angle.rate": 2e-2, "muscle_moment": 0.05, "exo_moment": 0.05,
    "elbow_reaction": 2.0, "effort": 1e-3, "return": 0.05, "observation": 0.1, "load": 1e-9,
}  # fmt: skip


def test_trajectories_stay_what_they_are():
    with FILE.open(newline="") as file:
        known = list(csv.DictReader(file))
    found = rows()
    assert len(found) == len(known)
    for a, b in zip(found, known, strict=True):
        assert (a["case"], a["step"]) == (b["case"], b["step"])
        for name, most in TOLERANCE.items():
            assert abs(float(a[name]) - float(b[name])) <= most, (a["case"], a["step"], name, a[name], b[name])
    assert len(known) == 7 * len(CASES) and np.ptp([float(row[COLUMNS[0]]) for row in known]) > 0.3

"""What can be read of an episode, and drawn? Every sensor of the model, without noise, at each control time."""

import tempfile
from pathlib import Path

import matplotlib
import numpy as np

from exo_env.envs.elbow_lift import ElbowLiftEnv

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

env = ElbowLiftEnv(patient="stroke_mild", action_mode="pid_setpoint", load=1.0)
env.reset(seed=3)
names = ("reference", "elbow_angle.angle", "muscle_moment", "exo_moment")
rows = []
for _ in range(200):
    env.step(np.array([0.0, 0.0]))
    r = env.readings()
    rows.append([r["time"], *(r[name] for name in names)])
print(f"{len(r)} readings, among them", sorted(r)[:4])
times, *columns = np.array(rows).T
figure, (above, below) = plt.subplots(2, 1, sharex=True)
for ax, chosen in ((above, (0, 1)), (below, (2, 3))):
    for k in chosen:
        ax.plot(times, columns[k], label=f"{names[k]} [{env.reading_units().get(names[k], 'rad')}]")
    ax.legend()
below.set_xlabel("time [s]")
path = Path(tempfile.mkdtemp()) / "episode.png"
figure.savefig(path)
print(f"drawn: {path}, {path.stat().st_size // 1000} kB")

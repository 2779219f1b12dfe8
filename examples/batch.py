"""How do I step many patients at once? One compiled batch on all cores, each world equal to a single one bit by bit."""

import time

import gymnasium
import numpy as np

from exo_env.envs.elbow_lift import ElbowLiftEnv

worlds = gymnasium.make_vec("exo_env:exo/ElbowLift-v2", num_envs=32, patient="mixed")
alone = ElbowLiftEnv(patient="mixed")
seen, _ = worlds.reset(seed=0)
same, _ = alone.reset(seed=7)
actions = np.random.default_rng(0).uniform(-0.6, -0.2, (40, 32, 2))
begin = time.perf_counter()
for action in actions:
    seen, rewards, terminated, truncated, infos = worlds.step(action)
print(f"{32 * 40 / (time.perf_counter() - begin):.0f} control periods a second")
for action in actions[:, 7]:
    same, *_ = alone.step(action)
print("world 7 is the environment of seed 7:", bool((seen[7] == same).all()))
worlds.close()

"""How do I make episodes harder as training goes on? By options of every reset from now on, automatic ones included."""

import numpy as np

from exo_env.envs.elbow_lift import ElbowLiftVectorEnv

worlds = ElbowLiftVectorEnv(4, autoreset_mode="SameStep", episode_duration=0.2, action_mode="pid_setpoint")
for load in (0.5, 1.0, 2.0):
    worlds.set_reset_options({"load": {"uniform": [0.9 * load, 1.1 * load]}})
    worlds.reset(seed=0)
    for _ in range(20):
        worlds.step(np.zeros((4, 2)))
    # These episodes began by themselves.
    print(f"stage of {load} kg:", [round(env.episode.load, 2) for env in worlds.envs])
worlds.close()

# With Stable-Baselines3: worlds.env_method("set_reset_options", {...}) of exo_env.envs.elbow_lift_sb3.ElbowLiftVecEnv.

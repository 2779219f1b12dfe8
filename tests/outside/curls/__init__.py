"""An outside project: a task of its own on exo_env, registered under its own name.

It is copied into an empty folder by test_outside.py and uses the installed wheel.
"""

from pathlib import Path

from gymnasium.envs.registration import register

register(
    id="curls/HeavyCurl-v0",
    entry_point="exo_env.envs.elbow_lift:ElbowLiftEnv",
    kwargs={
        "patient": str(Path(__file__).with_name("tired.yaml")),
        "load": {"uniform": [2.5, 3.0]},
        "exoskeleton": {"hinge_damping": 0.1},
        "action_mode": "pid_setpoint",
        "observation": ["device", "emg"],
        "reward_weights": {"tracking": 2.0},
        "episode_duration": 1.0,
    },
)

"""exo/ElbowLift-v2 as a VecEnv of Stable-Baselines3."""

from __future__ import annotations

from typing import Any

from gymnasium.vector import AutoresetMode

from exo_env.envs.elbow_lift import ElbowLiftVectorEnv
from exo_env.envs.stable_baselines import AssistanceVecEnv


class ElbowLiftVecEnv(AssistanceVecEnv):
    """Many ElbowLiftEnv for Stable-Baselines3.

    Args:
        num_envs: number of worlds.
        threads: number of threads that step them; None takes one for each core.
        settings: settings of ElbowLiftEnv.
    """

    def __init__(self, num_envs: int, *, threads: int | None = None, **settings: Any) -> None:
        same_step = AutoresetMode.SAME_STEP
        super().__init__(ElbowLiftVectorEnv(num_envs, autoreset_mode=same_step, threads=threads, **settings))

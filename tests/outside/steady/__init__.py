"""An outside project: a task, a device, a force, an arm and patients of its own, registered under its own names.

It is copied into an empty folder by test_outside.py and uses the installed wheel; nothing of it is known to exo_env.
"""

from pathlib import Path

from gymnasium.envs.registration import register

FOLDER = Path(__file__).parent

for name in ("HoldStill", "TwoMuscles"):
    register(
        id=f"steady/{name}-v0",
        entry_point=f"steady.envs:{name}Env",
        vector_entry_point=f"steady.envs:{name}VectorEnv",
        disable_env_checker=True,
    )

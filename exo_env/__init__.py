"""The human-exoskeleton ecosystem of the paper (sect. 4): subject, elbow exoskeleton and gym machine in one system.

Importing it registers the environments with Gymnasium and loads nothing else; take what you need from the folders:

    envs        the environments, one file an id; many worlds in one compiled batch; Stable-Baselines3
    tasks       one file a task, on what its folders hold: observation, movements, judgement (rewards and limits)
    drives      what an action does to the device
    patient     who is assisted, populations, and in its folder excitation how an intention becomes excitations
    ecosystem   the three subsystems of Fig. 8, from configs/, joined into one dms_core System
    world       the arrays of one world; its folders hold compiled functions (kernels) and episodes
    rendering   pictures of an episode
    paper       the paper's use cases and its controller tuning
"""

from gymnasium.envs.registration import register

from dms_core.renamed import moved_modules
from exo_env.old_names import MOVED, NAMES

moved_modules("exo_env", MOVED, NAMES)

# Gymnasium's passive checker takes a first reset that raised for done, and breaks at the next step; the environment
# checks its arguments itself.
for name, place in (
    ("ElbowLift-v2", "elbow_lift:ElbowLift"),
    ("HiddenIntent-v0", "hidden_intent:HiddenIntent"),
    ("NewPatient-v0", "hidden_intent:NewPatient"),
):
    register(
        id=f"exo/{name}",
        entry_point=f"exo_env.envs.{place}Env",
        vector_entry_point=f"exo_env.envs.{place}VectorEnv",
        disable_env_checker=True,
    )

"""The human-exoskeleton ecosystem of the paper (sect. 4): subject, elbow exoskeleton and gym machine in one system.

Importing it registers the environment exo/ElbowLift-v0 with Gymnasium and loads nothing else; take what you need from
the modules:

    lift_env                          the environment, made of actions, observations, rewards, events, episode
    vector_env, sb3                   many of them in one compiled batch, for Gymnasium and for Stable-Baselines3
    human, exoskeleton, gym_machine   the three subsystems of Fig. 8, from configs/
    ecosystem                         joins them into one dms_core System
    motor_command                     what the subject's muscles are told
    patient, population, effort       who is assisted, and how a patient's command becomes excitations
    scenarios, orderings, tune        the paper's use cases and its controller tuning
    arm26                             the bare arm under a table of excitations
"""

from gymnasium.envs.registration import register

# Gymnasium's passive checker takes a first reset that raised for done, and breaks at the next step; the environment
# checks its arguments itself.
register(
    id="exo/ElbowLift-v0",
    entry_point="exo_env.lift_env:ElbowLiftEnv",
    vector_entry_point="exo_env.vector_env:ElbowLiftVectorEnv",
    disable_env_checker=True,
)

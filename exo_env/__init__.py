"""The human-exoskeleton ecosystem of the paper (sect. 4): subject, elbow exoskeleton and gym machine in one system.

Nothing is imported here, so that `import exo_env` is quick; take what you need from the modules:

    human, exoskeleton, gym_machine   the three subsystems of Fig. 8, from configs/
    ecosystem                         joins them into one dms_core System
    motor_command                     what the subject's muscles are told
    scenarios, orderings, tune        the paper's use cases and its controller tuning
    arm26                             the bare arm under a table of excitations
"""

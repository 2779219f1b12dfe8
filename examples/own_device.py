"""What changes when the device changes? Here a heavier lower link and a motor that is a hundred times slower."""

import numpy as np

from exo_env.envs.elbow_lift import ElbowLiftEnv

changes = {
    "the shipped device": None,
    "a lower link of 1 kg": {"lower_link": {"mass": 1.0}},
    "slow motors": {"actuator": {"time_constant": 0.1}},
}
for name, exoskeleton in changes.items():
    env = ElbowLiftEnv(exoskeleton=exoskeleton, action_mode="pid_setpoint", patient="healthy", load=1.0)
    env.reset(seed=1)
    errors, tensions = [], []
    for _ in range(200):
        *_, terminated, _, info = env.step(np.array([0.0, 0.0]))  # half of the PID's authority
        errors.append(info["tracking_error_deg"])
        tensions.append(env.readings()["agonist_tension"])
        if terminated:
            break
    rms = np.sqrt(np.mean(np.square(errors)))
    print(f"{name:22} rms error {rms:.2f} deg, peak tension {max(tensions):.0f} N, after {len(errors)} periods")
    print(" " * 22, info.get("event", "nothing unsafe"))

# A device of one's own is a file like configs/exoskeletons/elbow.yaml: ElbowLiftEnv(exoskeleton="mine.yaml").

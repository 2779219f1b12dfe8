"""What do the gains of the device's PID do to the error? `python -m exo_env tune` finds them by Ziegler and Nichols."""

import numpy as np

from exo_env.envs.elbow_lift import ElbowLiftEnv

for share in (0.02, 0.1, 1.0):
    device = ElbowLiftEnv().ecosystem.device
    gains = {"kp": share * device.gains.kp, "kd": share * device.gains.kd}
    env = ElbowLiftEnv(exoskeleton={"gains": gains}, action_mode="pid_setpoint", patient="stroke_mild", load=1.0)
    env.reset(seed=2)
    errors = [env.step(np.array([0.0, 1.0]))[4]["tracking_error_deg"] for _ in range(150)]
    print(f"kp = {gains['kp']:7.1f} N/rad: rms error {np.sqrt(np.mean(np.square(errors))):.2f} deg")

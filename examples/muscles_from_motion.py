"""Which muscles made a motion? Net moments from the recorded angles alone, then the smallest activations for them."""

import numpy as np

from dms_core.analyses import inverse_dynamics, motion_of, static_optimisation
from exo_env.paper.scenarios import load_scenarios, run

exercise, scenarios = load_scenarios()
impaired = run(scenarios[2], exercise)
system = impaired.trajectory.model.system
motion = motion_of(impaired.trajectory, ["elbow_angle", "grip"], 0.005)
times = np.arange(0.0, exercise.duration, 0.02)
ropes = [force.name for force in system.forces if force.kind == "rope_force"]
inverse = inverse_dynamics(system, times, motion, leave_out=ropes)
measured = impaired.trajectory.sensors(times)
net = measured["muscle_moment"] + measured["exo_moment"]
error = inverse.loads["elbow_angle"] - net
print(f"net moment at the elbow: up to {np.abs(net).max():.2f} Nm; found with an rms error of {error.std():.4f} Nm")
# What the device gave is known from its ropes; the muscles gave the rest.
theirs = inverse.loads["elbow_angle"] - measured["exo_moment"]
found = static_optimisation(system, inverse, loads={"elbow_angle": theirs})
for k, muscle in enumerate(found.muscles):
    was = measured[f"{muscle}.sensor.activation"]
    rms = np.sqrt(np.mean((found.activations[:, k] - was) ** 2))
    print(f"{muscle:9} peak activation {was.max():.3f}, found {found.activations[:, k].max():.3f}, rms error {rms:.4f}")

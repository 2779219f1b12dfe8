"""Which moment does a movement need? A driver makes the elbow follow it, and its multiplier is the moment."""

import math

import numpy as np

from dms_core import SolverOptions, simulate
from dms_core.model import GROUND, AngleDriver, Gravity, Input, MinimumJerk, Revolute, System
from exo_env.ecosystem.arm import Arm

arm = Arm()
start, end = math.radians(20.0), math.radians(100.0)
forearm = next(body for body in arm.bodies(start) if body.name == "forearm")
axis = tuple(arm.axis)
elbow = Revolute(
    name="elbow", body_i=GROUND, body_j="forearm", point_i=tuple(arm.elbow), point_j=(0.0, 0.0, 0.0), axis_i=axis,
    axis_j=axis,
)  # fmt: skip
driver = AngleDriver(name="driver", joint="elbow", input="psi", pointer_i=(0.0, -1.0, 0.0), pointer_j=(0.0, -1.0, 0.0))
course = MinimumJerk(times=(0.2, 1.2), values=(start, end))
system = System(
    "driven forearm", bodies=[forearm], constraints=[elbow, driver],
    forces=[Gravity(name="gravity", acceleration=arm.gravity)], inputs=[Input(name="psi", signal=course)],
)  # fmt: skip
trajectory = simulate(system, 1.4, SolverOptions(rtol=1e-6)).check()
states = trajectory.at(np.array([0.0, 0.5, 0.9, 1.4]))
row = trajectory.model.layout.row_names.index("driver.angle")
for t, moment in zip(states.t, -states.lam[:, row], strict=True):
    print(f"t = {t:.1f} s: {moment:6.2f} Nm")
print(f"at rest at 100 deg the formula gives {-arm.gravity_moment(end):.2f} Nm")

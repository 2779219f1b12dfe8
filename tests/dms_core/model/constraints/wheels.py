"""Bodies that turn about fixed axes along z: what tests of gears, belts, racks and drums are built from."""

from __future__ import annotations

import numpy as np

from dms_core.assembly.model import Model
from dms_core.model import Constant, Input, JointMotor, Revolute, RigidBody, System
from dms_core.model.signals import Signal
from dms_core.results import Trajectory
from dms_core.simulation.dynamics import SolverOptions, simulate

TIGHT = SolverOptions(rtol=1e-7)
"""Of the runs."""
NEAR = 2e-5
"""Error of a turn over its size that a second of such a run leaves: a method of order 2 errs by rtol^(2/3)."""


def wheel(name: str, inertia: float, x: float = 0.0, **changes) -> RigidBody:
    """A body with an inertia about z [kg m^2], whose centre of mass is at (x, 0, 0)."""
    about = (0.7 * inertia, 0.7 * inertia, inertia)
    return RigidBody(name=name, mass=1.0, inertia=about, position=(x, 0.0, 0.0), **changes)


def axle(body: RigidBody, carrier: str = "ground") -> Revolute:
    """The hinge of a wheel at its centre, '<wheel>_axle'."""
    name = f"{body.name}_axle"
    return Revolute(name=name, body_i=carrier, body_j=body.name, point_i=body.position, point_j=(0.0, 0.0, 0.0))


def torque(joint: str) -> JointMotor:
    """A motor on a joint, with the input 'torque'."""
    return JointMotor(name="motor", joint=joint, input="torque")


def run(time: float, *, torque: float | Signal | None = None, options: SolverOptions = TIGHT, **parts) -> Trajectory:
    """A run of a system of these parts, a tight one by default."""
    signal = Constant(value=torque) if isinstance(torque, float) else torque
    inputs = [] if signal is None else [Input(name="torque", signal=signal)]
    return simulate(Model(System("wheels", inputs=inputs, **parts)), time, options).check()


def turned(found: Trajectory, body: str) -> np.ndarray:
    """Turn of a body about z since the start at each step, without jumps [rad]."""
    names = found.model.layout.names
    k = names.index(f"{body}.p0")
    p = found.q[:, k : k + 4]
    half = np.unwrap(np.arctan2(p[:, 3], p[:, 0]))
    return 2.0 * (half - half[0])

"""Two bodies in general position: the stage of most examples."""

from __future__ import annotations

from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.signals import Input
from dms_core.model.system import System

UPPER = RigidBody(
    name="upper",
    mass=1.8,
    inertia=(0.02, 0.03, 0.025, 0.002, -0.003, 0.004),
    centre_of_mass=(0.0, -0.2, 0.02),
    position=(0.1, 0.2, -0.3),
    orientation=(0.9, 0.2, -0.3, 0.1),
)
LOWER = RigidBody(
    name="lower",
    mass=1.5,
    inertia=(0.019, 0.001, 0.02),
    centre_of_mass=(0.01, -0.18, 0.0),
    position=(0.2, -0.1, 0.1),
    orientation=(0.7, -0.4, 0.3, 0.5),
)
WEIGHT = RigidBody(name="weight", mass=10.0, inertia=(0.1, 0.1, 0.1), position=(1.0, 0.0, 0.2))


def pair(*, constraints=(), forces=(), sensors=(), inputs=()) -> System:
    """Both bodies, whose centres of mass lie off their reference origins, a weight, and what is to be looked at."""
    return System(
        bodies=[UPPER, LOWER, WEIGHT],
        constraints=constraints,
        forces=forces,
        sensors=sensors,
        inputs=[Input(name=n) for n in inputs],
    )

"""Examples of bodies."""

from __future__ import annotations

from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.system import System
from tests.example_elements import Example


def rigid() -> Example:
    """Full inertia matrix, so that no axis is special."""
    body = RigidBody(name="arm", mass=1.8, inertia=(0.02, 0.03, 0.025, 0.002, -0.003, 0.004), centre_of_mass=(0.0, -0.2, 0.0))
    return Example(System(bodies=[body]), body)


EXAMPLES = {"rigid_body": (rigid,)}

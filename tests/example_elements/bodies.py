"""Examples of bodies."""

from __future__ import annotations

from dms_core.model.bodies import PointMass
from dms_core.model.system import System
from tests.example_elements import Example
from tests.example_elements.pair import UPPER, pair


def rigid() -> Example:
    """Full inertia matrix, so that no axis is special."""
    return Example(pair(), UPPER)


def point() -> Example:
    """A mass of 3 kg."""
    body = PointMass(name="ball", mass=3.0, position=(0.1, 0.2, 0.3))
    return Example(System(bodies=[body]), body)


EXAMPLES = {"rigid_body": (rigid,), "point_mass": (point,)}

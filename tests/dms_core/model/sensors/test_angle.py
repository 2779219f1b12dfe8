"""The angle sensor against a rotation whose course is known."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.constraints.joints.revolute import Revolute
from dms_core.model.sensors import JointAngle
from dms_core.model.system import System
from tests.dms_core.model.hinged import GROUND_BLOCK, sensed, turning

AXIS = (0.3, -0.2, 0.9)
COURSE = (0.7, -1.3, 2.1)
# A dozen products of numbers of size 1.
ROUNDING = 1e-14


def _system(sensor: JointAngle) -> System:
    body = RigidBody(name="arm", mass=1.0, inertia=(0.1, 0.1, 0.1))
    return System(bodies=[body], constraints=[Revolute(name="hinge", body_j="arm", axis_i=AXIS)], sensors=[sensor])


def _on_ground(course) -> list[np.ndarray]:
    ground = (GROUND_BLOCK, np.zeros(7), np.zeros(7))
    return [np.concatenate(pair) for pair in zip(ground, turning(AXIS, *course), strict=True)]


def test_angle_rate_and_acceleration_are_those_of_the_rotation() -> None:
    """A body that turns about the joint axis by x(t) shows x, x', x''."""
    sensor = JointAngle(name="angle", joint="hinge")
    y = sensed(sensor, sensor.place(_system(sensor)), *_on_ground(COURSE))
    assert y == pytest.approx(COURSE, abs=ROUNDING)


def test_only_relative_motion_counts() -> None:
    """When body_i turns about the same axis as well, the differences show."""
    sensor = JointAngle(name="angle", joint="hinge")
    first = (0.4, 0.9, -3.0)
    both = [np.concatenate(p) for p in zip(turning(AXIS, *first), turning(AXIS, *COURSE), strict=True)]
    y = sensed(sensor, sensor.place(_system(sensor)), *both)
    assert y == pytest.approx(np.subtract(COURSE, first), abs=ROUNDING)


def test_pointers_set_the_zero() -> None:
    """With pointers 0.5 rad apart about the axis, the angle is shifted by that and nothing else changes."""
    sensor = JointAngle(name="angle", joint="hinge", pointer_i=(1.0, 0.0, 0.0), pointer_j=(1.0, 0.0, 0.0))
    plain = JointAngle(name="angle", joint="hinge", pointer_i=(1.0, 0.0, 0.0))
    system, state = _system(sensor), _on_ground(COURSE)
    turned = _rotate(AXIS, 0.5, (1.0, 0.0, 0.0))
    shifted = JointAngle(name="angle", joint="hinge", pointer_i=(1.0, 0.0, 0.0), pointer_j=tuple(turned))
    expected = sensed(plain, plain.place(system), *state)
    assert sensed(sensor, sensor.place(system), *state) == pytest.approx(expected, abs=ROUNDING)
    assert sensed(shifted, shifted.place(system), *state) == pytest.approx(expected + [0.5, 0.0, 0.0], abs=ROUNDING)


def _rotate(axis, angle: float, vector) -> np.ndarray:
    """Rodrigues' formula."""
    n, x = np.asarray(axis) / np.linalg.norm(axis), np.asarray(vector, float)
    return x * np.cos(angle) + np.cross(n, x) * np.sin(angle) + n * (n @ x) * (1.0 - np.cos(angle))


def test_unknown_joint_lists_the_joints() -> None:
    """The error names what would have been right."""
    sensor = JointAngle(name="angle", joint="knee")
    with pytest.raises(ModelError, match="'knee' does not exist.*hinge"):
        sensor.place(_system(sensor))

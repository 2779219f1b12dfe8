"""Point and inertial sensors against circular motion, rest and free fall."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.forces import Gravity
from dms_core.model.geometry.frames import rotation_matrix, unit
from dms_core.model.sensors import Imu, Point
from dms_core.model.system import System
from tests.dms_core.model.hinged import sensed, turning

AXIS = (0.3, -0.2, 0.9)
ANGLE, RATE, ACCELERATION = 0.7, -1.3, 2.1
CENTRE, PLACE = (0.1, -0.2, 0.05), (0.3, 0.1, -0.2)
G = (0.0, -9.80665, 0.0)
# A dozen products of numbers of size 10.
ROUNDING = 1e-13


def _system() -> System:
    return System(bodies=[RigidBody(name="arm", mass=1.0, inertia=(0.1, 0.1, 0.1), centre_of_mass=CENTRE)])


def _circular() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration of PLACE: A s, w x A s, w' x A s + w x (w x A s)."""
    q, _, _ = turning(AXIS, ANGLE, RATE, ACCELERATION)
    n = unit(AXIS, "axis")
    x = rotation_matrix(q[3:]) @ np.subtract(PLACE, CENTRE)
    return x, np.cross(RATE * n, x), np.cross(ACCELERATION * n, x) + np.cross(RATE * n, np.cross(RATE * n, x))


def test_point_of_a_turning_body_moves_on_a_circle() -> None:
    """Tangential and centripetal acceleration, about the centre of mass at the origin."""
    sensor = Point(name="hand", body="arm", point=PLACE)
    y = sensed(sensor, sensor.place(_system()), *turning(AXIS, ANGLE, RATE, ACCELERATION))
    assert y == pytest.approx(np.concatenate(_circular()), abs=ROUNDING)


def test_translation_adds() -> None:
    """Coordinates, velocities and accelerations of the centre of mass are added."""
    sensor = Point(name="hand", body="arm", point=PLACE)
    q, v, a = turning(AXIS, ANGLE, RATE, ACCELERATION)
    shift = np.arange(1.0, 10.0)
    q[:3], v[:3], a[:3] = shift[:3], shift[3:6], shift[6:]
    y = sensed(sensor, sensor.place(_system()), q, v, a)
    assert y == pytest.approx(np.concatenate(_circular()) + shift, abs=ROUNDING)


def test_ground_point_rests() -> None:
    """A point of the ground is where it is declared."""
    sensor = Point(name="mark", body="ground", point=PLACE)
    q = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    y = sensed(sensor, sensor.place(_system()), q, np.zeros(7), np.zeros(7))
    assert y == pytest.approx([*PLACE, 0, 0, 0, 0, 0, 0], abs=ROUNDING)


def test_accelerometer_at_rest_shows_minus_g_in_body_axes() -> None:
    """Rest in a turned pose."""
    sensor = Imu(name="imu", body="arm", point=PLACE, gravity=G)
    q, v, a = turning(AXIS, ANGLE, 0.0, 0.0)
    y = sensed(sensor, sensor.place(_system()), q, v, a)
    assert y[:3] == pytest.approx(-rotation_matrix(q[3:]).T @ G, abs=ROUNDING)
    assert y[3:] == pytest.approx(np.zeros(3), abs=ROUNDING)


def test_accelerometer_in_free_fall_shows_nothing() -> None:
    """The centre of mass falls with g."""
    sensor = Imu(name="imu", body="arm", point=CENTRE, gravity=G)
    q, v, a = turning(AXIS, ANGLE, RATE, ACCELERATION)
    a[:3] = G
    assert sensed(sensor, sensor.place(_system()), q, v, a)[:3] == pytest.approx(np.zeros(3), abs=ROUNDING)


def test_gyroscope_and_accelerometer_of_a_turning_body() -> None:
    """About a fixed axis the angular velocity is the same in ground and body axes."""
    sensor = Imu(name="imu", body="arm", point=PLACE, gravity=G)
    q, v, a = turning(AXIS, ANGLE, RATE, ACCELERATION)
    y = sensed(sensor, sensor.place(_system()), q, v, a)
    assert y[:3] == pytest.approx(rotation_matrix(q[3:]).T @ (_circular()[2] - np.array(G)), abs=ROUNDING)
    assert y[3:] == pytest.approx(RATE * unit(AXIS, "axis"), abs=ROUNDING)


def test_gravity_of_the_system_is_taken_when_none_is_given() -> None:
    body = RigidBody(name="arm", mass=1.0, inertia=(0.1, 0.1, 0.1))
    sensor = Imu(name="imu", body="arm")
    system = System(bodies=[body], forces=[Gravity(name="g", acceleration=(0.0, 0.0, -3.7))], sensors=[sensor])
    assert sensor.place(system).numbers[3:] == (0.0, 0.0, -3.7)

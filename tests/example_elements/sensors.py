"""Examples of sensors of bodies, joints and coordinates."""

from __future__ import annotations

from dms_core.model.control.pid import Pid
from dms_core.model.control.reference_filter import ReferenceFilter
from dms_core.model.element import GROUND, Sensor
from dms_core.model.sensors.angle import JointAngle
from dms_core.model.sensors.coordinate import CoordinateSensor
from dms_core.model.sensors.imu import Imu
from dms_core.model.sensors.point import Point
from dms_core.model.sensors.tracking import Tracking
from tests.example_elements import Example
from tests.example_elements.control import controlled

PLACE = (0.12, -0.3, 0.07)


def _seen(sensor: Sensor, *forces, **options) -> Example:
    return Example(controlled(*forces, sensors=[sensor], **options), sensor)


def joint_angle() -> Example:
    """Between two moving bodies."""
    return _seen(JointAngle(name="angle", joint="hinge"))


def joint_angle_ground() -> Example:
    """Against the ground, with pointers."""
    sensor = JointAngle(name="angle", joint="hinge", pointer_i=(1.0, 0.0, 0.2), pointer_j=(1.0, 0.3, 0.1))
    return _seen(sensor, body_i=GROUND)


def point() -> Example:
    """Off the centre of mass."""
    return _seen(Point(name="hand", body="lower", point=PLACE))


def imu() -> Example:
    """Off the centre of mass."""
    return _seen(Imu(name="imu", body="lower", point=PLACE))


def coordinate() -> Example:
    """The integral of a controller."""
    pid = Pid(name="pid", joint="hinge", reference="psi", kp=40.0)
    return _seen(CoordinateSensor(name="integral", coordinate="pid.error_integral", unit="rad s"), pid)


def tracking() -> Example:
    """A controller of an input."""
    return _seen(Tracking(name="tracking", pid="pid"), Pid(name="pid", joint="hinge", reference="psi", kp=40.0))


def tracking_filtered() -> Example:
    """A controller of an input and a filter."""
    setpoint = ReferenceFilter(name="filter", input="wish", frequency=7.0)
    pid = Pid(name="pid", joint="hinge", reference="psi", offset="filter.setpoint", kp=40.0)
    return _seen(Tracking(name="tracking", pid="pid"), setpoint, pid)


EXAMPLES = {
    "joint_angle": (joint_angle, joint_angle_ground),
    "point": (point,),
    "imu": (imu,),
    "coordinate": (coordinate,),
    "tracking": (tracking, tracking_filtered),
}

COMPOSITES = {
    "joint_reaction": "tests/dms_core/assembly/test_composite_sensors.py",
    "joint_moment": "tests/dms_core/assembly/test_composite_sensors.py",
    "force_load": "tests/dms_core/assembly/test_force_loads.py",
}

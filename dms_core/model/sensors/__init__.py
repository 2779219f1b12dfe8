"""What can be measured: y = h(q, v, vdot, lam, mu, u) (paper sect. 2.4, eq. 5-6)."""

from dms_core.model.sensors.angle import JointAngle
from dms_core.model.sensors.contact import ContactSensor
from dms_core.model.sensors.coordinate import CoordinateSensor
from dms_core.model.sensors.imu import Imu
from dms_core.model.sensors.muscle import MuscleSensor
from dms_core.model.sensors.point import Point
from dms_core.model.sensors.rope import RopeSensor
from dms_core.model.sensors.tracking import Tracking
from dms_core.model.sensors.winch import WinchSensor

__all__ = [
    "ContactSensor",
    "CoordinateSensor",
    "Imu",
    "JointAngle",
    "MuscleSensor",
    "Point",
    "RopeSensor",
    "Tracking",
    "WinchSensor",
]

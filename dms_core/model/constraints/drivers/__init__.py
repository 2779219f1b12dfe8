"""Drivers: joint angles and positions that follow an input."""

from dms_core.model.constraints.drivers.angle_driver import AngleDriver
from dms_core.model.constraints.drivers.position_driver import PositionDriver

__all__ = ["AngleDriver", "PositionDriver"]

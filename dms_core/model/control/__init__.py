"""Controllers and actuators inside the DAE (paper sect. 3.5)."""

from dms_core.model.control.actuator import RopeActuator
from dms_core.model.control.delayed_error import DelayedError
from dms_core.model.control.impedance import ImpedanceController
from dms_core.model.control.pid import Pid
from dms_core.model.control.reference_filter import ReferenceFilter
from dms_core.model.control.sensor_pid import SensorPid
from dms_core.model.control.state_space import StateSpace
from dms_core.model.control.ziegler_nichols import CriticalGain, Gains, find_critical_gain, ziegler_nichols

__all__ = [
    "CriticalGain",
    "DelayedError",
    "Gains",
    "ImpedanceController",
    "Pid",
    "ReferenceFilter",
    "RopeActuator",
    "SensorPid",
    "StateSpace",
    "find_critical_gain",
    "ziegler_nichols",
]

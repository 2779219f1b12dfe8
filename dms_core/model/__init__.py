"""Everything that can be declared (paper Fig. 3): one import path for users.

    from dms_core.model import Gravity, Revolute, RigidBody

Base classes for elements of your own, and the contract of their kernels, are in `dms_core.model.element`.
"""

from dms_core.model.bodies import PointMass, RigidBody
from dms_core.model.constraints import (
    AngleDriver,
    Distance,
    EulerNorm,
    Fixed,
    LineGuide,
    PlaneGuide,
    PositionDriver,
    Revolute,
    RopeLength,
    Slider,
    Spherical,
)
from dms_core.model.contact import CylinderContact, SphereContact, SpherePairContact
from dms_core.model.control import (
    DelayedError,
    ImpedanceController,
    Pid,
    ReferenceFilter,
    RopeActuator,
    SensorPid,
    StateSpace,
)
from dms_core.model.electric import DcMotor
from dms_core.model.element import GROUND
from dms_core.model.forces import (
    FirstOrder,
    Gravity,
    JointSpringDamper,
    JointStop,
    LumpedLoad,
    SecondOrder,
    SpringDamper,
)
from dms_core.model.muscles import ThelenCurves, ThelenMuscle
from dms_core.model.ropes import ElasticRope, PathPoint, RopeForce, Winch
from dms_core.model.sensors import (
    ContactSensor,
    CoordinateSensor,
    Imu,
    JointAngle,
    MuscleSensor,
    Point,
    RopeSensor,
    Tracking,
    WinchSensor,
)
from dms_core.model.sensors.joint_moment import JointMoment
from dms_core.model.sensors.reaction import JointReaction
from dms_core.model.signals import Constant, Function, Harmonic, Input, Lines, MinimumJerk, Spline, Steps
from dms_core.model.system import System

__all__ = [
    "GROUND",
    "AngleDriver",
    "Constant",
    "ContactSensor",
    "CoordinateSensor",
    "CylinderContact",
    "DcMotor",
    "DelayedError",
    "Distance",
    "ElasticRope",
    "EulerNorm",
    "FirstOrder",
    "Fixed",
    "Function",
    "Gravity",
    "Harmonic",
    "ImpedanceController",
    "Imu",
    "Input",
    "JointAngle",
    "JointMoment",
    "JointReaction",
    "JointSpringDamper",
    "JointStop",
    "LineGuide",
    "Lines",
    "LumpedLoad",
    "MinimumJerk",
    "MuscleSensor",
    "PathPoint",
    "Pid",
    "PlaneGuide",
    "Point",
    "PointMass",
    "PositionDriver",
    "ReferenceFilter",
    "Revolute",
    "RigidBody",
    "RopeActuator",
    "RopeForce",
    "RopeLength",
    "RopeSensor",
    "SecondOrder",
    "SensorPid",
    "Slider",
    "SphereContact",
    "SpherePairContact",
    "Spherical",
    "Spline",
    "SpringDamper",
    "StateSpace",
    "Steps",
    "System",
    "ThelenCurves",
    "ThelenMuscle",
    "Tracking",
    "Winch",
    "WinchSensor",
]

"""Everything that can be declared (paper Fig. 3): one import path for users.

    from dms_core.model import Gravity, Revolute, RigidBody

Base classes for elements of your own, and the contract of their kernels, are in `dms_core.model.element`.
"""

from dms_core.model.bodies import PointMass, RigidBody
from dms_core.model.constraints import (
    AngleDriver,
    Belt,
    Cylindrical,
    Distance,
    DrumRope,
    EulerNorm,
    Fixed,
    Gear,
    JointTerm,
    LinearCoupling,
    LineGuide,
    Planar,
    PlaneGuide,
    PositionDriver,
    Rack,
    Revolute,
    RopeLength,
    Screw,
    Slider,
    Spherical,
    Universal,
)
from dms_core.model.control import DelayedError, ImpedanceController, Pid, ReferenceFilter, RopeActuator
from dms_core.model.element import GROUND
from dms_core.model.forces import (
    Bushing,
    BushingCurves,
    FirstOrder,
    Gravity,
    JointMotor,
    JointSpringDamper,
    JointStop,
    LoadCurve,
    LumpedLoad,
    SecondOrder,
    SpringDamper,
    TorsionSpring,
    TurnCounter,
)
from dms_core.model.muscles import ThelenCurves, ThelenMuscle
from dms_core.model.ropes import PathPoint, RopeForce
from dms_core.model.sensors import CoordinateSensor, Imu, JointAngle, MuscleSensor, Point, RopeSensor, Tracking
from dms_core.model.sensors.force_load import ForceLoad
from dms_core.model.sensors.joint_moment import JointMoment
from dms_core.model.sensors.reaction import JointReaction
from dms_core.model.signals import Constant, Function, Harmonic, Input, Lines, MinimumJerk, Spline, Steps
from dms_core.model.system import System

__all__ = [
    "GROUND",
    "AngleDriver",
    "Belt",
    "Bushing",
    "BushingCurves",
    "Constant",
    "CoordinateSensor",
    "Cylindrical",
    "DelayedError",
    "Distance",
    "DrumRope",
    "EulerNorm",
    "FirstOrder",
    "Fixed",
    "ForceLoad",
    "Function",
    "Gear",
    "Gravity",
    "Harmonic",
    "ImpedanceController",
    "Imu",
    "Input",
    "JointAngle",
    "JointMoment",
    "JointMotor",
    "JointReaction",
    "JointSpringDamper",
    "JointStop",
    "JointTerm",
    "LineGuide",
    "LinearCoupling",
    "Lines",
    "LoadCurve",
    "LumpedLoad",
    "MinimumJerk",
    "MuscleSensor",
    "PathPoint",
    "Pid",
    "Planar",
    "PlaneGuide",
    "Point",
    "PointMass",
    "PositionDriver",
    "Rack",
    "ReferenceFilter",
    "Revolute",
    "RigidBody",
    "RopeActuator",
    "RopeForce",
    "RopeLength",
    "RopeSensor",
    "Screw",
    "SecondOrder",
    "Slider",
    "Spherical",
    "Spline",
    "SpringDamper",
    "Steps",
    "System",
    "ThelenCurves",
    "ThelenMuscle",
    "TorsionSpring",
    "Tracking",
    "TurnCounter",
    "Universal",
]

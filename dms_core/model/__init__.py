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
from dms_core.model.control import DelayedError, ImpedanceController, Pid, ReferenceFilter, RopeActuator
from dms_core.model.element import GROUND
from dms_core.model.flexible import (
    Beam,
    BeamElement,
    BeamLoad,
    BeamSection,
    DistributedLoad,
    FloatingFrame,
    Interface,
    InterfaceFrame,
    ModalBody,
    ModalData,
    ModalNode,
    craig_bampton,
    orthogonal,
)
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
from dms_core.model.ropes import PathPoint, RopeForce
from dms_core.model.sensors import CoordinateSensor, Imu, JointAngle, MuscleSensor, Point, RopeSensor, Tracking
from dms_core.model.sensors.joint_moment import JointMoment
from dms_core.model.sensors.reaction import JointReaction
from dms_core.model.signals import Constant, Function, Harmonic, Input, Lines, MinimumJerk, Spline, Steps
from dms_core.model.system import System

__all__ = [
    "GROUND",
    "AngleDriver",
    "Beam",
    "BeamElement",
    "BeamLoad",
    "BeamSection",
    "Constant",
    "CoordinateSensor",
    "DelayedError",
    "Distance",
    "DistributedLoad",
    "EulerNorm",
    "FirstOrder",
    "Fixed",
    "FloatingFrame",
    "Function",
    "Gravity",
    "Harmonic",
    "ImpedanceController",
    "Imu",
    "Input",
    "Interface",
    "InterfaceFrame",
    "JointAngle",
    "JointMoment",
    "JointReaction",
    "JointSpringDamper",
    "JointStop",
    "LineGuide",
    "Lines",
    "LumpedLoad",
    "MinimumJerk",
    "ModalBody",
    "ModalData",
    "ModalNode",
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
    "Slider",
    "Spherical",
    "Spline",
    "SpringDamper",
    "Steps",
    "System",
    "ThelenCurves",
    "ThelenMuscle",
    "Tracking",
    "craig_bampton",
    "orthogonal",
]

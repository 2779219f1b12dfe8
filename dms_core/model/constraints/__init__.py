"""Constraints (paper sect. 3.2): intrabody and interbody equations phi = 0."""

from dms_core.model.constraints.couplings import Belt, DrumRope, Gear, JointTerm, LinearCoupling, Rack
from dms_core.model.constraints.drivers import AngleDriver, PositionDriver
from dms_core.model.constraints.euler_norm import EulerNorm
from dms_core.model.constraints.joints import (
    Cylindrical,
    Distance,
    Fixed,
    LineGuide,
    Planar,
    PlaneGuide,
    Revolute,
    Screw,
    Slider,
    Spherical,
    Universal,
)
from dms_core.model.constraints.rope_length import RopeLength

__all__ = [
    "AngleDriver",
    "Belt",
    "Cylindrical",
    "Distance",
    "DrumRope",
    "EulerNorm",
    "Fixed",
    "Gear",
    "JointTerm",
    "LineGuide",
    "LinearCoupling",
    "Planar",
    "PlaneGuide",
    "PositionDriver",
    "Rack",
    "Revolute",
    "RopeLength",
    "Screw",
    "Slider",
    "Spherical",
    "Universal",
]

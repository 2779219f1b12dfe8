"""Constraints (paper sect. 3.2): intrabody and interbody equations phi = 0."""

from dms_core.model.constraints.angle_driver import AngleDriver
from dms_core.model.constraints.distance import Distance
from dms_core.model.constraints.euler_norm import EulerNorm
from dms_core.model.constraints.fixed import Fixed
from dms_core.model.constraints.line_guide import LineGuide
from dms_core.model.constraints.plane_guide import PlaneGuide
from dms_core.model.constraints.position_driver import PositionDriver
from dms_core.model.constraints.revolute import Revolute
from dms_core.model.constraints.rope_length import RopeLength
from dms_core.model.constraints.slider import Slider
from dms_core.model.constraints.spherical import Spherical

__all__ = [
    "AngleDriver",
    "Distance",
    "EulerNorm",
    "Fixed",
    "LineGuide",
    "PlaneGuide",
    "PositionDriver",
    "Revolute",
    "RopeLength",
    "Slider",
    "Spherical",
]

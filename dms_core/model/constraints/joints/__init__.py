"""Joints and guides: what a pair of bodies leaves free."""

from dms_core.model.constraints.guides.line_guide import LineGuide
from dms_core.model.constraints.guides.plane_guide import PlaneGuide
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.constraints.joints.cylindrical import Cylindrical
from dms_core.model.constraints.joints.distance import Distance
from dms_core.model.constraints.joints.fixed import Fixed
from dms_core.model.constraints.joints.planar import Planar
from dms_core.model.constraints.joints.revolute import Revolute
from dms_core.model.constraints.joints.screw import Screw
from dms_core.model.constraints.joints.slider import Slider
from dms_core.model.constraints.joints.spherical import Spherical
from dms_core.model.constraints.joints.universal import Universal

__all__ = [
    "AxisJoint",
    "Cylindrical",
    "Distance",
    "Fixed",
    "LineGuide",
    "Planar",
    "PlaneGuide",
    "Revolute",
    "Screw",
    "Slider",
    "Spherical",
    "Universal",
]

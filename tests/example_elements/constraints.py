"""Examples of constraints."""

from __future__ import annotations

from dms_core.model.constraints import (
    AngleDriver,
    Cylindrical,
    Distance,
    EulerNorm,
    Fixed,
    LineGuide,
    Planar,
    PlaneGuide,
    PositionDriver,
    Revolute,
    Screw,
    Slider,
    Spherical,
    Universal,
)
from dms_core.model.element import Constraint
from tests.example_elements import Example
from tests.example_elements.pair import pair

PAIR = {"body_i": "upper", "body_j": "lower", "point_i": (0.03, -0.3, 0.05)}
HINGE = Revolute(name="hinge", axis_i=(0.2, -0.1, 1.0), **PAIR)


def _joint(element: Constraint, *inputs: str) -> Example:
    return Example(pair(constraints=[HINGE, element], inputs=inputs), element)


def norm() -> Example:
    """The equation of the first body."""
    system = pair()
    return Example(system, system.element("upper.euler_norm", EulerNorm))


def hinge() -> Example:
    """Axis along no coordinate axis."""
    return Example(pair(constraints=[HINGE]), HINGE)


def ball() -> Example:
    """Points off both centres of mass."""
    return _joint(Spherical(name="ball", **PAIR))


def weld() -> Example:
    """Pose from the start."""
    return _joint(Fixed(name="weld", **PAIR))


def weld_to_ground() -> Example:
    """Pose given, first body the ground."""
    return _joint(Fixed(name="weld", body_j="lower", point_j=(0.1, 0.0, 0.2), orientation=(0.3, 0.2, -0.5, 1.0)))


def slider() -> Example:
    """Axis along no coordinate axis."""
    return _joint(Slider(name="rail", axis_i=(1.0, 0.5, -0.3), **PAIR))


def plane() -> Example:
    """A given point in a tilted plane."""
    return _joint(PlaneGuide(name="guide", normal_i=(1.0, 0.5, -0.3), point_j=(0.0, -0.2, 0.1), **PAIR))


def line() -> Example:
    """A given point on a tilted line."""
    return _joint(LineGuide(name="guide", axis_i=(1.0, 0.5, -0.3), point_j=(0.0, -0.2, 0.1), **PAIR))


def rod() -> Example:
    """Between points off both centres of mass."""
    return _joint(Distance(name="rod", point_j=(0.0, -0.2, 0.1), length=0.4, **PAIR))


def rod_between_centres() -> Example:
    """Ends at the centres of mass, where the pattern has no Euler parameters."""
    ends = {"point_i": (0.0, -0.2, 0.02), "point_j": (0.01, -0.18, 0.0)}
    return _joint(Distance(name="rod", body_i="upper", body_j="lower", **ends))


def angle() -> Example:
    """The hinge's angle."""
    return _joint(AngleDriver(name="drive", joint="hinge", input="psi", pointer_j=(1.0, 0.2, 0.3)), "psi")


def position() -> Example:
    """A point along a tilted direction."""
    return _joint(
        PositionDriver(name="drive", axis_i=(1.0, 0.5, -0.3), point_j=(0.1, 0.2, 0.0), input="x", **PAIR), "x"
    )


def sleeve() -> Example:
    """Axis along no coordinate axis."""
    return _joint(Cylindrical(name="sleeve", axis_i=(1.0, 0.5, -0.3), point_j=(0.0, -0.2, 0.1), **PAIR))


def table() -> Example:
    """A tilted plane, and a normal of the second body that is given."""
    own = {"point_j": (0.0, -0.2, 0.1), "axis_j": (0.1, 0.2, 1.0)}
    return _joint(Planar(name="table", axis_i=(1.0, 0.5, -0.3), **own, **PAIR))


def nut() -> Example:
    """A left-handed thread."""
    return _joint(Screw(name="nut", axis_i=(1.0, 0.5, -0.3), point_j=(0.0, -0.2, 0.1), lead=-0.8, **PAIR))


def cross() -> Example:
    """Arms along no coordinate axes."""
    return _joint(Universal(name="cross", axis_i=(1.0, 0.5, -0.3), axis_j=(0.1, 1.0, 0.2), **PAIR))


EXAMPLES = {
    "euler_norm": (norm,),
    "revolute": (hinge,),
    "spherical": (ball,),
    "fixed": (weld, weld_to_ground),
    "slider": (slider,),
    "plane_guide": (plane,),
    "line_guide": (line,),
    "distance": (rod, rod_between_centres),
    "angle_driver": (angle,),
    "position_driver": (position,),
    "cylindrical": (sleeve,),
    "planar": (table,),
    "screw": (nut,),
    "universal": (cross,),
}

"""Examples of couplings: relations between joints of the upper and lower body, the weight and the ground."""

from __future__ import annotations

from dms_core.model.constraints import (
    Belt,
    Cylindrical,
    DrumRope,
    Gear,
    JointTerm,
    LinearCoupling,
    Rack,
    Revolute,
)
from dms_core.model.element import Constraint
from dms_core.model.ropes import PathPoint
from tests.example_elements import Example
from tests.example_elements.constraints import HINGE
from tests.example_elements.pair import pair

AXLE = Revolute(name="axle", body_i="lower", body_j="weight", point_i=(0.1, 0.0, 0.2), axis_i=(0.3, 1.0, 0.2))
SLEEVE = Cylindrical(name="sleeve", body_j="weight", axis_i=(0.3, 0.2, -1.0))


def _coupled(element: Constraint) -> Example:
    return Example(pair(constraints=[HINGE, AXLE, SLEEVE, element]), element)


def _linear(name: str, terms: list[tuple[str, str, float]]) -> Example:
    coordinates = tuple(JointTerm(joint=j, coordinate=c, factor=x) for j, c, x in terms)  # type: ignore[arg-type]
    return _coupled(LinearCoupling(name=name, coordinates=coordinates))


def gear() -> Example:
    """Between joints of three bodies: the faster wheel has a turn counter."""
    return _coupled(Gear(name="gear", joint_i="hinge", joint_j="axle", ratio=-2.5))


def belt() -> Example:
    """Crossed."""
    return _coupled(Belt(name="belt", joint_i="hinge", joint_j="axle", radius_i=0.1, radius_j=0.25, crossed=True))


def rack() -> Example:
    """An angle and a way, no counter."""
    return _coupled(Rack(name="rack", pinion="hinge", rail="sleeve", radius=0.07))


def differential() -> Example:
    """Three angles and a way of joints that share bodies: two turn counters."""
    terms = [("hinge", "angle", 0.5), ("axle", "angle", -1.5), ("sleeve", "angle", 0.7), ("sleeve", "slide", 3.0)]
    return _linear("differential", terms)


def ways() -> Example:
    """Of one joint's way and its own angle."""
    terms = [("sleeve", "slide", -2.0), ("sleeve", "angle", 0.1)]
    return _linear("thread", terms)


def drum_rope() -> Example:
    """From the drum's carrier over the ground to a third body."""
    path = (
        PathPoint(body="upper", point=(0.13, -0.3, 0.05)),
        PathPoint(point=(0.3, 0.5, 0.1)),
        PathPoint(body="weight", point=(0.1, 0.1, 0.0)),
    )
    return _coupled(DrumRope(name="rope", joint="hinge", radius=0.1, path=path))


def drum_rope_to_the_drums_own_body() -> Example:
    """Path and drum share both bodies, and the winding is given."""
    path = (PathPoint(body="upper", point=(0.03, -0.3, 0.05)), PathPoint(body="lower", point=(0.0, 0.1, 0.3)))
    return _coupled(DrumRope(name="rope", joint="hinge", radius=0.1, path=path, winding="takes_up"))


EXAMPLES = {
    "gear": (gear,),
    "belt": (belt,),
    "rack": (rack,),
    "linear_coupling": (differential, ways),
    "drum_rope": (drum_rope, drum_rope_to_the_drums_own_body),
}

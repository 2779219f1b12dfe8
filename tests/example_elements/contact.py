"""Examples of contacts, so large that bodies in any position of the tests touch."""

from __future__ import annotations

from dms_core.model.contact import (
    CylinderContact,
    CylinderPairContact,
    SphereContact,
    SphereCylinderContact,
    SpherePairContact,
)
from dms_core.model.element import Force
from dms_core.model.sensors import ContactSensor
from tests.example_elements import Example
from tests.example_elements.pair import pair

LAW = {"stiffness": 90.0, "restitution": 0.7, "impact_speed": 40.0, "friction": 0.4, "slip_speed": 0.5}
BODIES = {"body_i": "upper", "body_j": "lower"}
PLANE = {"point_i": (0.1, 9.0, -0.2), "normal_i": (0.3, 2.0, -0.5)}
SPHERE = SphereContact(name="touch", centre_j=(0.1, 0.2, -0.3), radius=1.5, **PLANE, **BODIES, **LAW)
INPUT = SphereContact(
    name="touch", body_j="lower", centre_j=(0.1, 0.2, -0.3), radius=1.5, impact_speed_input="speed", **PLANE, **LAW
)
SPHERES = SpherePairContact(
    name="touch", centre_i=(0.4, -0.1, 0.2), radius_i=3.0, centre_j=(-0.2, 0.5, 0.1), radius_j=2.0, **BODIES, **LAW
)
CYLINDER = CylinderContact(
    name="touch", centre_j=(0.1, 0.2, -0.3), axis_j=(0.2, 0.4, 1.0), radius=0.8, length=0.6, **PLANE, **BODIES, **LAW
)
ON_A_CYLINDER = SphereCylinderContact(
    name="touch", centre_i=(0.4, -0.1, 0.2), axis_i=(0.3, 0.2, 1.0), radius_i=2.0, length_i=40.0,
    centre_j=(-0.2, 0.5, 0.1), radius_j=3.0, **BODIES, **LAW,
)  # fmt: skip
"""On its side. The spheres' centres of the next two are above an end of a wide disc, and beside a rod's rim."""
ON_AN_END = ON_A_CYLINDER.model_copy(update={"radius_i": 30.0, "length_i": 0.02, "radius_j": 4.0})
ON_A_RIM = ON_A_CYLINDER.model_copy(update={"radius_i": 0.02, "length_i": 0.02, "radius_j": 6.0})

CROSSED = CylinderPairContact(
    name="touch", centre_i=(0.4, -0.1, 0.2), axis_i=(0.3, 0.2, 1.0), radius_i=3.0, length_i=40.0,
    centre_j=(-0.2, 0.5, 0.1), axis_j=(1.0, 0.3, 0.2), radius_j=2.0, length_j=30.0, **BODIES, **LAW,
)  # fmt: skip
"""The next two touch with an end of the second one, and with ends of both."""
WITH_AN_END = CROSSED.model_copy(update={"length_j": 0.02})
WITH_BOTH_ENDS = WITH_AN_END.model_copy(update={"length_i": 0.02})


def _touch(element: Force, *inputs: str) -> Example:
    return Example(pair(forces=[element], inputs=inputs), element, u={"speed": (20.0, 60.0)})


def _sensed(element: Force, *inputs: str) -> Example:
    sensor = ContactSensor(name="sense", contact="touch", end=1)
    return Example(pair(forces=[element], sensors=[sensor], inputs=inputs), sensor, u={"speed": (20.0, 60.0)})


def sphere() -> Example:
    """Two moving bodies."""
    return _touch(SPHERE)


def sphere_on_ground() -> Example:
    """On the ground, at an impact speed from an input."""
    return _touch(INPUT, "speed")


def spheres() -> Example:
    """Two spheres."""
    return _touch(SPHERES)


def spheres_at_a_speed() -> Example:
    """At an impact speed from an input."""
    return _touch(SPHERES.model_copy(update={"impact_speed_input": "speed"}), "speed")


def on_a_cylinder() -> Example:
    """A sphere on the side of a cylinder."""
    return _touch(ON_A_CYLINDER)


def on_an_end() -> Example:
    """On an end of it."""
    return _touch(ON_AN_END)


def on_a_rim() -> Example:
    """On a rim."""
    return _touch(ON_A_RIM)


def on_a_cylinder_at_a_speed() -> Example:
    """At an impact speed from an input."""
    return _touch(ON_A_CYLINDER.model_copy(update={"impact_speed_input": "speed"}), "speed")


def crossed() -> Example:
    """The sides of two cylinders."""
    return _touch(CROSSED)


def with_an_end() -> Example:
    """An end on a side."""
    return _touch(WITH_AN_END)


def with_both_ends() -> Example:
    """Two ends."""
    return _touch(WITH_BOTH_ENDS)


def crossed_at_a_speed() -> Example:
    """At an impact speed from an input."""
    return _touch(CROSSED.model_copy(update={"impact_speed_input": "speed"}), "speed")


def cylinder_at_a_speed() -> Example:
    """At an impact speed from an input."""
    return _touch(CYLINDER.model_copy(update={"impact_speed_input": "speed"}), "speed")


def cylinder() -> Example:
    """Both ends."""
    return _touch(CYLINDER)


def sensed_sphere() -> Example:
    """Sensor of a sphere."""
    return _sensed(SPHERE)


def sensed_on_a_rim() -> Example:
    """Sensor of a sphere on a rim."""
    return _sensed(ON_A_RIM)


def sensed_pair() -> Example:
    """Sensor of two cylinders."""
    return _sensed(CROSSED)


def sensed_cylinder() -> Example:
    """Sensor of one end."""
    return _sensed(CYLINDER)


def sensed_input() -> Example:
    """Sensor of a contact that reads an input."""
    return _sensed(INPUT, "speed")


EXAMPLES = {
    "sphere_contact": (sphere, sphere_on_ground),
    "sphere_pair_contact": (spheres, spheres_at_a_speed),
    "sphere_cylinder_contact": (on_a_cylinder, on_an_end, on_a_rim, on_a_cylinder_at_a_speed),
    "cylinder_pair_contact": (crossed, with_an_end, with_both_ends, crossed_at_a_speed),
    "cylinder_contact": (cylinder, cylinder_at_a_speed),
    "contact_sensor": (sensed_sphere, sensed_on_a_rim, sensed_pair, sensed_cylinder, sensed_input),
}

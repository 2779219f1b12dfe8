"""Whether two systems differ in numbers only, and the digest that says so in another process."""

import pytest

from dms_core.assembly.layout import Layout, same_structure
from dms_core.model import JointReaction, Revolute, RigidBody, Spherical, System


def held_twice(read: str, mass: float = 1.0) -> Layout:
    """A body held by a hinge and a ball joint, with a sensor of the reaction in one of them."""
    body = RigidBody(name="rod", mass=mass, inertia=(0.1, 0.1, 0.1))
    hinge = Revolute(name="hinge", body_j="rod")
    ball = Spherical(name="ball", body_j="rod", point_i=(0.0, 0.0, 1.0), point_j=(0.0, 0.0, 1.0))
    return Layout(
        System(
            "rod",
            bodies=[body],
            constraints=[hinge, ball],
            sensors=[JointReaction(name="reaction", constraint=read, body="rod")],
        )
    )


@pytest.mark.parametrize(("other", "same"), [(held_twice("hinge", 2.0), True), (held_twice("ball"), False)])
def test_what_a_sensor_reads_is_structure_and_a_mass_is_not(other, same):
    one = held_twice("hinge")
    assert same_structure(one, other) == (one.digest == other.digest) == same

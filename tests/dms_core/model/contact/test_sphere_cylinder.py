"""A sphere on a cylinder against closed forms: where it leaves, impacts on side, end and rim, energy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import ContactSensor, Gravity, PointMass, RigidBody, SphereCylinderContact, System
from dms_core.model.geometry.frames import g_matrix, rotation_matrix
from dms_core.simulation.dynamics import SolverOptions, World, simulate
from dms_core.simulation.events import Crossing

G, MASS, STIFFNESS = 9.81, 0.5, 1e9
UNDER, BALL = 0.3, 0.1
"""Radii of the cylinder and of the sphere on it [m]."""
START = 0.1
"""Angle from the top at which it is released [rad]."""


def on_top(friction: float, inertia: float = 0.4, stiffness: float = STIFFNESS, restitution: float = 0.2) -> Model:
    """A sphere at rest near the top of a fixed cylinder along z, as deep as its weight presses it there."""
    reach = UNDER + BALL - (MASS * G * math.cos(START) / stiffness) ** (2.0 / 3.0)
    ball = RigidBody(
        name="ball", mass=MASS, inertia=(inertia * MASS * BALL**2,) * 3,
        position=(reach * math.sin(START), reach * math.cos(START), 0.2),
    )  # fmt: skip
    touch = SphereCylinderContact(
        name="touch", body_j="ball", radius_i=UNDER, length_i=2.0, radius_j=BALL, stiffness=stiffness,
        restitution=restitution, impact_speed=0.01, friction=friction, slip_speed=1e-5,
    )  # fmt: skip
    weight = Gravity(name="weight", acceleration=(0.0, -G, 0.0))
    sensor = ContactSensor(name="touch_sensor", contact="touch")
    return Model(System("off the cylinder", bodies=[ball], forces=[touch, weight], sensors=[sensor]))


WAYS = {
    "sliding": (0.0, 0.4, 2.0 / 3.0),
    "rolling": (1e3, 0.4, 10.0 / 17.0),
    "rolling roller": (1e3, 0.5, 4.0 / 7.0),
    "rolling shell": (1e3, 2.0 / 3.0, 6.0 / 11.0),
}
"""Friction, I / m r^2, and cos a of the place where it leaves from rest on the top."""


@pytest.mark.parametrize("way", WAYS)
def test_it_leaves_the_cylinder_at_the_angle_of_the_textbook(way):
    """m v^2 (1 + I / m r^2) / 2 = m g R (cos a0 - cos a), N = m g cos a - m v^2 / R: 0 at 2 cos a0 / (3 + I / m r^2).

    N is a line in cos a, whose root is the place. It rolls as long as friction has no limit: with a coefficient of 1000
    until the last thousandth of its weight.
    """
    friction, inertia, cosine = WAYS[way]
    run = simulate(on_top(friction, inertia), 1.0, SolverOptions(rtol=1e-8)).check()
    load = run.sensors(run.t)["touch_sensor.normal"] / (MASS * G)
    cos = run.q[:, 1] / np.hypot(run.q[:, 0], run.q[:, 1])
    left = int(np.flatnonzero(load <= 0.0)[0])
    lines = (load > 0.2) & (load < 0.6) & (np.arange(len(load)) < left)
    slope, offset = np.polyfit(cos[lines], load[lines], 1)
    # Depth over radius is 7e-6; the acceleration of the depth, where it runs out, makes a share of 1e-4 of the weight.
    assert -offset / slope == pytest.approx(cosine * math.cos(START), abs=5e-5)
    assert slope == pytest.approx(1.0 + 2.0 / (1.0 + (inertia if friction else 0.0)), rel=3e-4)
    assert run.q[-1, 2] == pytest.approx(0.2, abs=1e-9)


def test_a_stiffer_contact_lets_go_earlier_and_nearer_to_that_angle():
    """As N goes to 0 so does the stiffness, k^(2/3) N^(1/3); without damping it is late by a time of k^(-2/7)."""
    late = []
    for stiffness in (1e8, 128e8):
        world = World(on_top(0.0, stiffness=stiffness, restitution=1.0), SolverOptions(rtol=1e-8))
        assert world.advance(5.0, stop_at=Crossing("touch_sensor.gap", way=1)).name == "SUCCESS"
        x, y = world.state.q[:2]
        assert math.hypot(x, y) == pytest.approx(UNDER + BALL, rel=1e-9)
        late.append(2.0 / 3.0 * math.cos(START) - y / math.hypot(x, y))
    assert 0.0 < late[1] < 1e-3
    assert late[0] / late[1] == pytest.approx(4.0, rel=0.1)


PLACES = {
    "side": ((0.0, 1.0, 0.0), (0.0, UNDER, 0.3)),
    "end": ((0.0, 0.0, 1.0), (0.1, 0.05, 1.0)),
    "middle of an end": ((0.0, 0.0, -1.0), (0.0, 0.0, -1.0)),
    "rim": ((0.6, 0.0, 0.8), (UNDER, 0.0, 1.0)),
}
"""Normal there, and a place of the surface of the cylinder of 2 m along z."""


HITS = [(place, radius) for place in PLACES for radius in (0.0, BALL) if (place, radius) != ("rim", 0.0)]
"""A point meets a side or an end: the corner itself has no normal."""


@pytest.mark.parametrize(("place", "radius"), HITS)
def test_an_impact_gives_back_the_restitution_along_the_normal(place, radius):
    """Head on, wherever it hits."""
    normal, surface = (np.array(x) for x in PLACES[place])
    start = surface + (radius + 1e-3) * normal
    ball = PointMass(name="ball", mass=MASS, position=tuple(start), velocity=tuple(-2.0 * normal))
    touch = SphereCylinderContact(
        name="touch", body_j="ball", radius_i=UNDER, length_i=2.0, radius_j=radius, stiffness=1e7, restitution=0.6,
        impact_speed=2.0, friction=0.5,
    )  # fmt: skip
    run = simulate(System("impact", bodies=[ball], forces=[touch]), 0.02, SolverOptions(rtol=1e-9)).check()
    np.testing.assert_allclose(run.v[-1], 1.2 * normal, atol=2e-5)


def test_both_bodies_move_and_momentum_and_energy_are_kept():
    """A spinning rod is hit by a ball, without friction and damping."""
    rod = RigidBody(
        name="rod", mass=1.2, inertia=(0.04, 0.04, 0.01), angular_velocity=(9.0, 0.0, 2.0), orientation=(0.8, 0.6, 0, 0)
    )
    ball = RigidBody(name="ball", mass=0.4, inertia=(1e-3,) * 3, position=(0.0, 0.35, 0.1), velocity=(0.0, -3.0, 0.0))
    touch = SphereCylinderContact(
        name="touch", body_i="rod", body_j="ball", radius_i=0.05, length_i=0.6, radius_j=0.08, stiffness=1e6
    )
    sensor = ContactSensor(name="touch_sensor", contact="touch")
    system = System("rod and ball", bodies=[rod, ball], forces=[touch], sensors=[sensor])
    run = simulate(system, 0.15, SolverOptions(rtol=1e-8)).check()
    gap = run.sensors(run.t)["touch_sensor.gap"]
    assert gap.min() < -1e-4 and gap[0] > 0.0 and gap[-1] > 0.0
    spin = 2.0 * np.einsum("tij,tj->ti", np.array([g_matrix(p) for p in run.q[:, 3:7]]), run.v[:, 3:7])
    energy = 0.6 * (run.v[:, :3] ** 2).sum(1) + 0.2 * (run.v[:, 7:10] ** 2).sum(1)
    energy += 0.5 * spin**2 @ np.array([0.04, 0.04, 0.01]) + 0.4 * 1e6 * np.maximum(-gap, 0.0) ** 2.5
    assert energy == pytest.approx(energy[0], rel=1e-6)
    pushed = 1.2 * run.v[:, :3] + 0.4 * run.v[:, 7:10]
    assert pushed == pytest.approx(np.tile([0.0, -1.2, 0.0], (len(run.t), 1)), abs=1e-9)
    turns = np.array([rotation_matrix(p) for p in run.q[:, 3:7]])
    turning = np.einsum("tij,tj->ti", turns, np.array([0.04, 0.04, 0.01]) * spin)
    turning += 1.2 * np.cross(run.q[:, :3], run.v[:, :3]) + 0.4 * np.cross(run.q[:, 7:10], run.v[:, 7:10])
    assert turning == pytest.approx(np.tile(turning[0], (len(run.t), 1)), abs=2e-6)


@pytest.mark.parametrize(
    ("numbers", "complaint"),
    [
        ({"radius_i": 0.0}, "radius_i = 0.0: Expected a number above 0"),
        ({"length_i": -1.0}, "length_i = -1.0: Expected a number above 0"),
        ({"radius_j": -0.1}, "radius_j = -0.1: Expected a number of at least 0"),
        ({"restitution": -0.1}, "restitution = -0.1: Expected a number above 0"),
        ({"axis_i": (0.0, 0.0, 0.0)}, "sphere_cylinder_contact 'touch': axis_i = .* has length 0"),
        ({"body_i": "ball"}, "two different bodies, got 'ball' twice"),
    ],
)
def test_wrong_numbers_are_refused(numbers, complaint):
    given = {"body_j": "ball", "radius_i": 1.0, "length_i": 1.0, "stiffness": 1.0, **numbers}
    with pytest.raises(ModelError, match=complaint):
        Model(
            System(
                "x",
                bodies=[PointMass(name="ball", mass=1.0, position=(0.0, 3.0, 0.0))],
                forces=[SphereCylinderContact(name="touch", **given)],
            )
        )

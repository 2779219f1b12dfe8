"""Gears, belts, racks and linear couplings against closed forms, over many turns; and their mistakes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    Belt,
    Cylindrical,
    Gear,
    Gravity,
    Harmonic,
    JointTerm,
    LinearCoupling,
    LumpedLoad,
    Rack,
    Revolute,
    RigidBody,
    Screw,
    Slider,
    Spherical,
    System,
    TurnCounter,
)
from dms_core.simulation.dynamics import SolverOptions
from tests.dms_core.model.constraints.wheels import NEAR, axle, run, torque, turned, wheel

FIRST, SECOND = wheel("first", 0.02), wheel("second", 0.05, 1.0)
AXLES = [axle(FIRST), axle(SECOND)]


def two_wheels(coupling, time: float = 1.0, moment: float = 5.0):
    """Both wheels, coupled, from rest under a moment on the first."""
    return run(
        time, torque=moment, bodies=[FIRST, SECOND], constraints=[*AXLES, coupling], forces=[torque("first_axle")]
    )


class TestGear:
    @pytest.mark.parametrize("ratio", [-0.4, math.sqrt(2.0), 3.0, -1.0])
    def test_two_flywheels_under_a_moment(self, ratio):
        """theta_1 = M t^2 / (2 (J1 + ratio^2 J2)), theta_2 = ratio theta_1, after many turns, for any ratio."""
        inertia = 0.02 + ratio**2 * 0.05
        moment = 2.0 * inertia * 8.0 * 2.0 * math.pi
        found = two_wheels(Gear(name="gear", joint_i="first_axle", joint_j="second_axle", ratio=ratio), 1.0, moment)
        first, second = turned(found, "first"), turned(found, "second")
        assert first[-1] / (2.0 * math.pi) == pytest.approx(8.0, rel=NEAR)
        # The relation holds at every step as a constraint does.
        np.testing.assert_allclose(second, ratio * first, atol=1e-8)

    @pytest.mark.parametrize("method", ["bdf2", "sdirk2"])
    @pytest.mark.parametrize("ratio", [-11.3, 0.07])
    def test_a_coarse_run_loses_no_turn(self, ratio, method):
        """At rtol 1e-2, there and back, by more than a hundred turns of the faster wheel."""
        inertia = 0.02 + ratio**2 * 0.05
        swing = Harmonic(amplitude=60.0 * inertia, frequency=0.3)
        gear = Gear(name="gear", joint_i="first_axle", joint_j="second_axle", ratio=ratio)
        found = run(
            5.0, torque=swing, options=SolverOptions(rtol=1e-2, method=method), bodies=[FIRST, SECOND],
            constraints=[*AXLES, gear], forces=[torque("first_axle")],
        )  # fmt: skip
        first = turned(found, "first")
        assert np.abs(first).max() > 16.0 * 2.0 * math.pi
        np.testing.assert_allclose(turned(found, "second"), ratio * first, atol=1e-8)

    def test_its_multiplier_is_the_moment_that_it_passes_on(self):
        gear = Gear(name="gear", joint_i="first_axle", joint_j="second_axle", ratio=-2.0)
        found = two_wheels(gear, 0.2)
        row = found.model.layout.row_names.index("gear.relation")
        acceleration = 5.0 / (0.02 + 4.0 * 0.05)
        # -lam c on the second wheel, whose c is -1, is J2 times its acceleration.
        np.testing.assert_allclose(found.lam[:, row], 0.05 * -2.0 * acceleration, rtol=1e-4)

    def test_a_gear_brings_a_turn_counter_and_no_file_lists_it(self):
        gear = Gear(name="gear", joint_i="first_axle", joint_j="second_axle", ratio=-2.0)
        system = System(bodies=[FIRST, SECOND], constraints=[*AXLES, gear])
        assert [f.name for f in system.forces] == ["gear.turns.second_axle"]
        again = System(bodies=system.bodies, constraints=system.constraints, forces=system.forces)
        assert again.forces == system.forces

    def test_planetary_gear_set(self):
        """Willis's equation with a ring that stands: carrier over sun = z_s / (z_s + z_r); moments by virtual work."""
        z_sun, z_planet, z_ring, reach = 24, 16, 56, 0.3
        ratio = z_sun / (z_sun + z_ring)
        sun, carrier = wheel("sun", 0.01), wheel("carrier", 0.04)
        planet = RigidBody(name="planet", mass=0.5, inertia=(0.002, 0.002, 0.003), position=(reach, 0.0, 0.0))
        on_carrier = Revolute(
            name="pin", body_i="carrier", body_j="planet", point_i=planet.position, point_j=(0.0, 0.0, 0.0)
        )
        # Teeth in the carrier's frame: z_s (sun - carrier) = -z_p planet, z_r (0 - carrier) = z_p planet.
        sun_mesh = LinearCoupling(
            name="sun_mesh",
            coordinates=(
                JointTerm(joint="sun_axle", factor=z_sun),
                JointTerm(joint="carrier_axle", factor=-z_sun),
                JointTerm(joint="pin", factor=z_planet),
            ),
        )
        ring_mesh = LinearCoupling(
            name="ring_mesh",
            coordinates=(JointTerm(joint="carrier_axle", factor=z_ring), JointTerm(joint="pin", factor=z_planet)),
        )
        found = run(
            1.0,
            torque=4.0,
            bodies=[sun, carrier, planet],
            constraints=[axle(sun), axle(carrier), on_carrier, sun_mesh, ring_mesh],
            forces=[torque("sun_axle")],
        )
        # The planet turns in space by carrier + pin = carrier (1 - z_r / z_p).
        of_planet = ratio * (1.0 - z_ring / z_planet)
        inertia = 0.01 + ratio**2 * (0.04 + 0.5 * reach**2) + of_planet**2 * 0.003
        sun_turn, carrier_turn = turned(found, "sun"), turned(found, "carrier")
        assert sun_turn[-1] == pytest.approx(4.0 / (2.0 * inertia), rel=NEAR)
        assert sun_turn[-1] > 6.0 * math.pi
        np.testing.assert_allclose(carrier_turn, ratio * sun_turn, atol=1e-7)
        np.testing.assert_allclose(turned(found, "planet"), of_planet * sun_turn, atol=1e-7)


class TestBelt:
    @pytest.mark.parametrize("crossed", [False, True])
    def test_two_pulleys(self, crossed):
        belt = Belt(
            name="belt", joint_i="first_axle", joint_j="second_axle", radius_i=0.1, radius_j=0.25, crossed=crossed
        )
        found = two_wheels(belt)
        ratio = -0.4 if crossed else 0.4
        acceleration = 5.0 / (0.02 + ratio**2 * 0.05)
        first = turned(found, "first")
        assert first[-1] == pytest.approx(acceleration / 2.0, rel=NEAR)
        assert first[-1] > 10.0 * math.pi
        np.testing.assert_allclose(turned(found, "second"), ratio * first, atol=1e-8)
        # What the strands differ by turns the second pulley: T r2 = J2 alpha2.
        row = found.model.layout.row_names.index("belt.relation")
        np.testing.assert_allclose(np.abs(found.lam[:, row]), 0.05 * 0.4 * acceleration / 0.25, rtol=1e-4)


class TestRack:
    @pytest.mark.parametrize("radius", [0.03, -0.03])
    def test_a_force_on_the_rack_turns_the_pinion(self, radius):
        """x = F t^2 / (2 (m + J / r^2)), theta = x / r."""
        bar = RigidBody(name="bar", mass=2.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.5, 0.0))
        bed = Slider(name="bed", body_j="bar", axis_i=(1.0, 0.0, 0.0), point_i=(0.0, 0.5, 0.0))
        rack = Rack(name="rack", pinion="first_axle", rail="bed", radius=radius)
        pull = LumpedLoad(name="pull", body="bar", force=(60.0, 0.0, 0.0))
        found = run(1.0, bodies=[FIRST, bar], constraints=[axle(FIRST), bed, rack], forces=[pull])
        way = found.q[:, found.model.layout.names.index("bar.x")]
        assert way[-1] == pytest.approx(60.0 / (2.0 * (2.0 + 0.02 / radius**2)), rel=NEAR)
        turn = turned(found, "first")
        assert abs(turn[-1]) > 12.0 * math.pi
        np.testing.assert_allclose(radius * turn, way, atol=1e-9)

    def test_the_way_of_a_cylindrical_joint_and_its_start_count(self):
        """A way that begins at 0.2 m and a body whose centre of mass is off its origin."""
        bar = RigidBody(
            name="bar", mass=2.0, inertia=(0.1, 0.1, 0.1), position=(0.3, 0.5, 0.0), centre_of_mass=(0.05, 0.0, 0.0)
        )
        bed = Cylindrical(
            name="bed", body_j="bar", axis_i=(1.0, 0.0, 0.0), point_i=(0.1, 0.5, 0.0), point_j=(0.0, 0.0, 0.0),
        )  # fmt: skip
        rack = Rack(name="rack", pinion="first_axle", rail="bed", radius=0.1)
        model = Model(System(bodies=[FIRST, bar], constraints=[axle(FIRST), bed, rack]))
        assert model.start.moved < 1e-12


def test_counter_after_fifty_turns():
    """A free wheel: x = w t, with no error that grows with the turns."""
    spinning = wheel("spinning", 0.02, angular_velocity=(0.0, 0.0, 100.0 * math.pi))
    found = run(
        1.0, bodies=[spinning], constraints=[axle(spinning)], forces=[TurnCounter(name="turns", joint="spinning_axle")]
    )
    counted = found.q[:, found.model.layout.names.index("turns.angle")]
    assert counted[-1] == pytest.approx(100.0 * math.pi, rel=NEAR)
    np.testing.assert_allclose(counted, turned(found, "spinning"), atol=1e-3)


def test_two_ways_are_coupled_without_an_angle():
    """A hydraulic pair: x1 = 2 x2 under a force on the first, x1 = F t^2 / (2 (m + m / 4))."""
    blocks = [RigidBody(name=n, mass=2.0, inertia=(0.1, 0.1, 0.1)) for n in ("one", "two")]
    rails = [Slider(name=f"{b.name}_rail", body_j=b.name, axis_i=(1.0, 0.0, 0.0)) for b in blocks]
    terms = (
        JointTerm(joint="one_rail", coordinate="slide", factor=1.0),
        JointTerm(joint="two_rail", coordinate="slide", factor=-2.0),
    )
    pump = LinearCoupling(name="pump", coordinates=terms)
    push = LumpedLoad(name="push", body="one", force=(5.0, 0.0, 0.0))
    found = run(1.0, bodies=blocks, constraints=[*rails, pump], forces=[push])
    one, two = (found.q[-1, found.model.layout.names.index(f"{n}.x")] for n in ("one", "two"))
    assert one == pytest.approx(1.0, rel=NEAR)
    assert two == pytest.approx(0.5, rel=NEAR)


def test_a_coupling_of_an_angle_with_itself_and_a_way_is_a_screw():
    """Cylindrical joint with x = lead theta / (2 pi) by a coupling: the motion of a screw joint."""
    nut = RigidBody(name="nut", mass=1.0, inertia=(0.01, 0.01, 0.01))
    lead = 0.25
    terms = (
        JointTerm(joint="thread", coordinate="slide", factor=1.0),
        JointTerm(joint="thread", factor=-lead / (2.0 * math.pi)),
    )
    weight = Gravity(name="weight", acceleration=(0.0, 0.0, -9.81))
    one = run(1.0, bodies=[nut], forces=[weight], constraints=[Screw(name="thread", body_j="nut", lead=lead)])
    other = run(
        1.0, bodies=[nut], forces=[weight],
        constraints=[Cylindrical(name="thread", body_j="nut"), LinearCoupling(name="coupling", coordinates=terms)],
    )  # fmt: skip
    np.testing.assert_allclose(one.q[-1], other.q[-1], atol=1e-6)


MISTAKES = {
    "gear ratio 0": (
        lambda: Gear(name="gear", joint_i="a", joint_j="b", ratio=0.0),
        "gear 'gear': ratio = 0.0: Expected a ratio other than 0",
    ),
    "one joint": (
        lambda: Gear(name="gear", joint_i="a", joint_j="a", ratio=2.0),
        "joint_i and joint_j are both 'a': expected two different joints",
    ),
    "belt on one joint": (
        lambda: Belt(name="belt", joint_i="a", joint_j="a", radius_i=0.1, radius_j=0.1),
        "joint_i and joint_j are both 'a'",
    ),
    "belt without radius": (
        lambda: Belt(name="belt", joint_i="a", joint_j="b", radius_i=0.0, radius_j=0.1),
        "belt 'belt': radius_i = 0.0: Expected a number above 0",
    ),
    "rack without radius": (
        lambda: Rack(name="rack", pinion="a", rail="b", radius=0.0),
        "rack 'rack': radius = 0.0: Expected a radius other than 0",
    ),
    "rack of one joint": (lambda: Rack(name="rack", pinion="a", rail="a", radius=1.0), "use a screw"),
    "factor 0": (lambda: JointTerm(joint="a", factor=0.0), "factor = 0.0: Expected a factor other than 0"),
    "one coordinate": (
        lambda: LinearCoupling(name="c", coordinates=(JointTerm(joint="a", factor=1.0),)),
        "Expected at least 2 items, got 1",
    ),
    "a coordinate twice": (
        lambda: LinearCoupling(
            name="c", coordinates=(JointTerm(joint="a", factor=1.0), JointTerm(joint="a", factor=2.0))
        ),
        "the angle of 'a' is named twice",
    ),
    "screw without lead": (
        lambda: Screw(name="s", body_j="b", lead=0.0),
        "screw 's': lead = 0.0: Expected a lead other than 0",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_wrong_declaration_is_refused(mistake):
    declare, message = MISTAKES[mistake]
    with pytest.raises(ModelError, match=message):
        declare()


def test_two_couplings_of_the_same_coordinates():
    one = Gear(name="one", joint_i="first_axle", joint_j="second_axle", ratio=2.0)
    other = Belt(name="other", joint_i="second_axle", joint_j="first_axle", radius_i=0.1, radius_j=0.2)
    with pytest.raises(ModelError, match=r"belt 'other' determines how the angle of 'first_axle' and the angle of "
                       r"'second_axle' go together, which gear 'one' determines already. Remove one"):  # fmt: skip
        System(bodies=[FIRST, SECOND], constraints=[*AXLES, one, other])


def test_a_joint_without_that_coordinate():
    ball = Spherical(name="ball", body_j="first")
    rack = Rack(name="rack", pinion="ball", rail="second_axle", radius=0.1)
    with pytest.raises(ModelError, match="'ball' is a spherical. Expected the name of a .*Revolute or Screw"):
        Model(System(bodies=[FIRST, SECOND], constraints=[ball, AXLES[1], rack]))
    rack = Rack(name="rack", pinion="first_axle", rail="second_axle", radius=0.1)
    with pytest.raises(ModelError, match="'second_axle' is a revolute. Expected the name of a Cylindrical, Screw or S"):
        Model(System(bodies=[FIRST, SECOND], constraints=[*AXLES, rack]))


def test_a_joint_that_does_not_exist_is_named_with_the_coupling():
    gear = Gear(name="gear", joint_i="first_axle", joint_j="third_axle", ratio=2.0)
    with pytest.raises(ModelError, match="'gear.*': 'third_axle' does not exist"):
        Model(System(bodies=[FIRST, SECOND], constraints=[*AXLES, gear]))

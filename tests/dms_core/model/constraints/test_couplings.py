"""Gears, belts, racks, drums and linear couplings against closed forms, over many turns; and their mistakes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    Belt,
    Cylindrical,
    DrumRope,
    Gear,
    Gravity,
    Harmonic,
    JointReaction,
    JointTerm,
    LinearCoupling,
    LumpedLoad,
    PathPoint,
    PointMass,
    Rack,
    Revolute,
    RigidBody,
    RopeSensor,
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


class TestDrumRope:
    M1, M2, J, R = 3.0, 1.0, 0.04, 0.1

    def atwood(self, time: float = 1.0, **changes):
        """Atwood's machine, its pulley a drum with inertia: one rope is paid out as the other is taken up."""
        drum = wheel("drum", self.J)
        left = PointMass(name="left", mass=self.M1, position=(-self.R, -1.0, 0.0))
        right = PointMass(name="right", mass=self.M2, position=(self.R, -20.0, 0.0))
        ropes = [
            DrumRope(
                name=f"{body.name}_rope", joint="drum_axle", radius=self.R,
                path=(PathPoint(point=(body.position[0], 0.0, 0.0)), PathPoint(body=body.name, point=(0.0, 0.0, 0.0))),
                **changes,
            )
            for body in (left, right)
        ]  # fmt: skip
        return run(
            time,
            bodies=[drum, left, right],
            constraints=[axle(drum), *ropes],
            forces=[Gravity(name="weight", acceleration=(0.0, -9.81, 0.0))],
            sensors=[
                JointReaction(name="bearing", constraint="drum_axle", body="drum"),
                *(RopeSensor(name=r.name + "_sensor", rope=r.name, components=("tension",)) for r in ropes),
            ],
        )

    def test_atwood_machine_with_a_massive_drum(self):
        """a = (m1 - m2) g / (m1 + m2 + J / r^2), T1 = m1 (g - a), T2 = m2 (g + a)."""
        found = self.atwood()
        a = (self.M1 - self.M2) * 9.81 / (self.M1 + self.M2 + self.J / self.R**2)
        names = found.model.layout.names
        left, right = (found.q[:, names.index(f"{n}.y")] for n in ("left", "right"))
        assert left[-1] - left[0] == pytest.approx(-a / 2.0, rel=NEAR)
        np.testing.assert_allclose(left - left[0], right[0] - right, atol=1e-8)
        turn = turned(found, "drum")
        assert abs(turn[-1]) > 3.0 * math.pi
        # The left rope comes off the left rim: it is paid out where the drum turns as the hands of a clock do not.
        np.testing.assert_allclose(self.R * turn, left[0] - left, atol=1e-9)
        y = found.sensors(found.t)
        np.testing.assert_allclose(y["left_rope_sensor"], self.M1 * (9.81 - a), rtol=1e-4)
        np.testing.assert_allclose(y["right_rope_sensor"], self.M2 * (9.81 + a), rtol=1e-4)
        assert not found.flags
        # The bearing carries both strands; the drum's own weight is that of one kilogram.
        both = self.M1 * (9.81 - a) + self.M2 * (9.81 + a)
        np.testing.assert_allclose(y["bearing.Fy"], both + 9.81, rtol=1e-4)

    def test_a_rope_that_pushes_is_flagged(self):
        """The drum is turned faster than the mass falls."""
        drum, bob = wheel("drum", 0.01), PointMass(name="bob", mass=1.0, position=(0.1, -1.0, 0.0))
        rope = DrumRope(
            name="rope", joint="drum_axle", radius=0.1,
            path=(PathPoint(point=(0.1, 0.0, 0.0)), PathPoint(body="bob", point=(0.0, 0.0, 0.0))),
        )  # fmt: skip
        found = run(0.2, torque=-3.0, bodies=[drum, bob], constraints=[axle(drum), rope], forces=[torque("drum_axle")])
        assert "'rope': its tension was negative" in found.message

    def place(self, first=(0.1, 0.0, 0.0), first_body: str = "ground", **changes) -> None:
        drum, bob = wheel("drum", 0.01), PointMass(name="bob", mass=1.0, position=(0.1, -1.0, 0.0))
        path = (PathPoint(body=first_body, point=first), PathPoint(body="bob", point=(0.0, 0.0, 0.0)))
        rope = DrumRope(name="rope", joint="drum_axle", radius=0.1, path=path, **changes)
        Model(System(bodies=[drum, bob], constraints=[axle(drum), rope]))

    def test_a_drum_wound_backwards(self):
        self.place(winding="takes_up")
        with pytest.raises(ModelError, match=r"drum_rope 'rope': winding = 'pays_out', but the drum is wound the other"
                           r".*\(0.1, 0.0, 0.0\) of 'ground'.*Expected winding = 'takes_up'"):  # fmt: skip
            self.place(winding="pays_out")

    def test_a_winding_that_nothing_tells(self):
        with pytest.raises(
            ModelError, match=r"passes the axis of 'drum_axle' at 0 m.*Expected a first point at the ri"
        ):
            self.place(first=(0.0, 0.0, 0.0))
        self.place(first=(0.0, 0.0, 0.0), winding="pays_out")

    def test_a_rope_that_begins_on_the_drum(self):
        with pytest.raises(ModelError, match="path begins on 'drum'. Expected a point of 'ground', which carries"):
            self.place(first_body="drum")

    def test_a_rope_that_ends_where_it_begins(self):
        path = PathPoint(point=(0.1, 0.0, 0.0)), PathPoint(point=(0.1, -1.0, 0.0))
        drum, rope = wheel("drum", 0.01), DrumRope(name="rope", joint="drum_axle", radius=0.1, path=path)
        with pytest.raises(ModelError, match="all points of the path are on 'ground', which carries the drum"):
            Model(System(bodies=[drum], constraints=[axle(drum), rope]))

    def test_a_crane_that_carries_its_own_drum(self):
        """Momentum: a cart with a drum, and a sled on its rope; what pulls inside moves no centre of mass."""
        cart = RigidBody(name="cart", mass=4.0, inertia=(0.1, 0.1, 0.1))
        drum = RigidBody(name="drum", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0.5, 0.3, 0.0))
        sled = RigidBody(name="sled", mass=2.0, inertia=(0.1, 0.1, 0.1), position=(3.0, 0.4, 0.0))
        along = {"axis_i": (1.0, 0.0, 0.0)}
        pin = Revolute(name="pin", body_i="cart", body_j="drum", point_i=drum.position, point_j=(0.0, 0.0, 0.0))
        rope = DrumRope(
            name="rope", joint="pin", radius=0.1,
            path=(PathPoint(body="cart", point=(0.5, 0.4, 0.0)), PathPoint(body="sled", point=(0.0, 0.0, 0.0))),
        )  # fmt: skip
        rails = [Slider(name=f"{b.name}_rail", body_j=b.name, **along) for b in (cart, sled)]
        found = run(0.5, torque=2.0, bodies=[cart, drum, sled], constraints=[*rails, pin, rope], forces=[torque("pin")])
        names = found.model.layout.names
        x = {b: found.q[:, names.index(f"{b}.x")] - found.q[0, names.index(f"{b}.x")] for b in ("cart", "drum", "sled")}
        # The errors of position of 3,000 steps at rtol 1e-7 gather to some 1e-6 of a way of metres.
        np.testing.assert_allclose(5.0 * x["cart"] + 2.0 * x["sled"], 0.0, atol=2e-6)
        # Virtual work: with theta = s / r and the reduced mass of cart and sled, s = T / r t^2 / 2 / (m + J / r^2).
        reduced = 5.0 * 2.0 / 7.0
        way = 2.0 / 0.1 * 0.125 / (reduced + 0.01 / 0.1**2)
        assert abs(x["sled"][-1] - x["cart"][-1]) == pytest.approx(way, rel=NEAR)

    @pytest.mark.parametrize("radius", [0.0, -0.1])
    def test_a_radius_that_is_none(self, radius):
        with pytest.raises(ModelError, match=f"radius = {radius}: Expected a number above 0"):
            DrumRope(
                name="rope", joint="j", radius=radius, path=(PathPoint(point=(0, 0, 0)), PathPoint(point=(0, 1, 0)))
            )


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

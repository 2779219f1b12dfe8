"""Universal, cylindrical, planar and screw joints in motion, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    AngleDriver,
    Cylindrical,
    Gravity,
    JointAngle,
    JointMotor,
    JointReaction,
    MinimumJerk,
    Planar,
    Revolute,
    RigidBody,
    Screw,
    System,
    Universal,
)
from dms_core.model.geometry.frames import quaternion
from tests.dms_core.model.constraints.wheels import NEAR, axle, run, torque, turned, wheel


def course(found, name: str) -> np.ndarray:
    """A coordinate at each step."""
    return found.q[:, found.model.layout.names.index(name)]


class TestUniversal:
    BETA, J1, J2, RATE = 0.7, 0.03, 0.08, 9.0

    def shafts(self, time: float):
        """Two shafts that meet in the origin at the angle beta, coupled by a cross; the first one turns."""
        second_axis = np.array([math.cos(self.BETA), math.sin(self.BETA), 0.0])
        # At the start a_i is along z, across the plane of the shafts; a_j lies in it, across the second shaft.
        along_x = quaternion((0.0, 0.0, 1.0), self.BETA)
        # 1 / cos(beta) as fast is the second shaft's share where theta_j = atan(cos(beta) tan(theta_i)) begins.
        rate = self.RATE * math.cos(self.BETA)
        first = RigidBody(name="first", mass=1.0, inertia=(self.J1, 0.05, 0.05), angular_velocity=(self.RATE, 0.0, 0.0))
        second = RigidBody(
            name="second", mass=1.0, inertia=(self.J2, 0.05, 0.05), orientation=tuple(along_x),
            angular_velocity=tuple(rate * second_axis),
        )  # fmt: skip
        bearings = [
            Revolute(name="bearing_1", body_j="first", axis_i=(1.0, 0.0, 0.0)),
            Cylindrical(name="bearing_2", body_j="second", axis_i=tuple(second_axis)),
        ]
        cross = Universal(name="cross", body_i="first", body_j="second", axis_i=(0.0, 0.0, 1.0), axis_j=(0.0, 1.0, 0.0))
        angles = [JointAngle(name=f"angle_{k}", joint=f"bearing_{k}", pointer_i=(0.0, 0.0, 1.0),
                             pointer_j=(0.0, 0.0, 1.0)) for k in (1, 2)]  # fmt: skip
        return run(time, bodies=[first, second], constraints=[*bearings, cross], sensors=angles)

    def test_angles_of_a_cardan_joint_and_the_energy_of_its_shafts(self):
        """tan(theta_2) = cos(beta) tan(theta_1); J1 w1^2 + J2 w2^2 is constant, with w2 / w1 the ratio's derivative."""
        found = self.shafts(2.0)
        y = found.sensors(found.t)
        one, two = np.unwrap(y["angle_1.angle"]), np.unwrap(y["angle_2.angle"])
        assert one[-1] > 4.0 * math.pi
        expected = np.unwrap(np.arctan2(math.cos(self.BETA) * np.sin(one), np.cos(one)))
        np.testing.assert_allclose(two, expected, atol=1e-8)
        ratio = math.cos(self.BETA) / (1.0 - math.sin(self.BETA) ** 2 * np.sin(one) ** 2)
        energy = self.J1 + self.J2 * math.cos(self.BETA) ** 2
        rate = self.RATE * np.sqrt(energy / (self.J1 + self.J2 * ratio**2))
        np.testing.assert_allclose(y["angle_1.rate"], rate, rtol=1e-4)

    def test_arms_along_each_other(self):
        cross = Universal(name="cross", body_j="first", axis_i=(0.0, 0.0, 1.0), axis_j=(0.0, 0.0, 2.0))
        with pytest.raises(ModelError, match=r"universal 'cross': axis_i = .*along each other at the start. Exp"):
            Model(System(bodies=[wheel("first", 0.1)], constraints=[cross]))


class TestScrew:
    MASS, INERTIA = 0.5, 0.002

    def nut(self, lead: float, time: float = 1.0):
        """A nut that slides down a vertical screw without friction."""
        nut = RigidBody(name="nut", mass=self.MASS, inertia=(0.003, 0.003, self.INERTIA))
        return run(
            time,
            bodies=[nut],
            constraints=[Screw(name="thread", body_j="nut", lead=lead)],
            forces=[Gravity(name="weight", acceleration=(0.0, 0.0, -9.81))],
            sensors=[JointReaction(name="reaction", constraint="thread", body="nut")],
        )

    @pytest.mark.parametrize("lead", [0.2, -0.2, 0.04])
    def test_a_nut_slides_down(self, lead):
        """z = -g t^2 / 2 / (1 + J (2 pi / lead)^2 / m), theta = 2 pi z / lead; the thread carries the rest of g."""
        found = self.nut(lead)
        a = 9.81 / (1.0 + self.INERTIA * (2.0 * math.pi / lead) ** 2 / self.MASS)
        z, turn = course(found, "nut.z"), turned(found, "nut")
        assert z[-1] == pytest.approx(-a / 2.0, rel=NEAR)
        assert abs(turn[-1]) > 6.0
        np.testing.assert_allclose(z, lead * turn / (2.0 * math.pi), atol=1e-9)
        y = found.sensors(found.t)
        np.testing.assert_allclose(y["reaction.Fz"], self.MASS * (9.81 - a), rtol=1e-4)
        np.testing.assert_allclose(y["reaction.Mz"], -self.INERTIA * a * 2.0 * math.pi / lead, rtol=1e-4)

    def test_after_fifteen_turns(self):
        found = self.nut(0.04, 4.0)
        z, turn = course(found, "nut.z"), turned(found, "nut")
        assert abs(turn[-1]) > 15.0 * 2.0 * math.pi
        np.testing.assert_allclose(z, 0.04 * turn / (2.0 * math.pi), atol=1e-9)

    def test_a_screw_jack_lifts_with_the_moment_of_statics(self):
        """Without friction M = m g lead / (2 pi) holds the load: a motor of that moment leaves it at rest."""
        nut = RigidBody(name="nut", mass=self.MASS, inertia=(0.003, 0.003, self.INERTIA))
        found = run(
            0.5,
            torque=self.MASS * 9.81 * 0.04 / (2.0 * math.pi),
            bodies=[nut],
            constraints=[Screw(name="thread", body_j="nut", lead=0.04)],
            forces=[Gravity(name="weight", acceleration=(0.0, 0.0, -9.81)), torque("thread")],
        )
        assert np.abs(course(found, "nut.z")).max() < 1e-9


class TestCylindrical:
    def test_turn_and_slide_know_nothing_of_each_other(self):
        """theta = M t^2 / (2 J), z = -g t^2 / 2 on an upright shaft."""
        sleeve = wheel("sleeve", 0.01)
        found = run(
            1.0,
            torque=0.5,
            bodies=[sleeve],
            constraints=[Cylindrical(name="shaft", body_j="sleeve")],
            forces=[Gravity(name="weight", acceleration=(0.0, 0.0, -9.81)), torque("shaft")],
        )
        assert course(found, "sleeve.z")[-1] == pytest.approx(-9.81 / 2.0, rel=NEAR)
        assert turned(found, "sleeve")[-1] == pytest.approx(25.0, rel=NEAR)
        assert np.abs(course(found, "sleeve.x")).max() < 1e-9


class TestPlanar:
    def test_a_spinning_block_slides_down_a_slope(self):
        """a = g sin(slope) downhill, the spin about the normal stays, and the table presses with m g cos(slope)."""
        slope, spin = 0.4, 20.0
        normal = np.array([math.sin(slope), math.cos(slope), 0.0])
        # Principal axes with z along the normal, so that the spin is about one of them.
        upright = quaternion(np.cross([0.0, 0.0, 1.0], normal), math.pi / 2.0)
        block = RigidBody(
            name="block", mass=2.0, inertia=(0.01, 0.02, 0.025), orientation=tuple(upright),
            angular_velocity=tuple(spin * normal),
        )  # fmt: skip
        found = run(
            1.0,
            bodies=[block],
            constraints=[Planar(name="table", body_j="block", axis_i=tuple(normal))],
            forces=[Gravity(name="weight", acceleration=(0.0, -9.81, 0.0))],
            sensors=[
                JointReaction(name="table_force", constraint="table", body="block"),
                JointAngle(name="spin", joint="table"),
            ],
        )
        downhill = np.array([math.cos(slope), -math.sin(slope), 0.0])
        way = np.column_stack([course(found, f"block.{x}") for x in "xyz"])
        np.testing.assert_allclose(way[-1], 0.5 * 9.81 * math.sin(slope) * downhill, atol=1e-4)
        y = found.sensors(found.t)
        np.testing.assert_allclose(y["spin.rate"], spin, rtol=1e-5)
        force = np.column_stack([y[f"table_force.F{x}"] for x in "xyz"])
        np.testing.assert_allclose(force, np.tile(2.0 * 9.81 * math.cos(slope) * normal, (len(force), 1)), atol=1e-3)


def test_a_motor_spins_up_a_wheel():
    """w = M t / J, theta = M t^2 / (2 J)."""
    rotor = wheel("rotor", 0.02)
    found = run(1.0, torque=1.5, bodies=[rotor], constraints=[axle(rotor)], forces=[torque("rotor_axle")])
    assert turned(found, "rotor")[-1] == pytest.approx(37.5, rel=NEAR)


def test_a_motor_whose_angle_is_driven_needs_the_moment_of_its_acceleration():
    """theta = x (10 s^3 - 15 s^4 + 6 s^5) over six turns: M = J thetaddot, which is -lam."""
    rotor, way, time = wheel("rotor", 0.02), 12.0 * math.pi, 1.5
    plan = MinimumJerk(times=(0.0, time), values=(0.0, way))
    driver = AngleDriver(name="driver", joint="rotor_axle", input="torque")
    found = run(time, torque=plan, bodies=[rotor], constraints=[axle(rotor), driver])
    s = found.t / time
    np.testing.assert_allclose(turned(found, "rotor"), way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2), atol=1e-8)
    moment = 0.02 * way / time**2 * 60.0 * s * (1.0 - 3.0 * s + 2.0 * s**2)
    row = found.model.layout.row_names.index("driver.angle")
    np.testing.assert_allclose(-found.lam[:, row], moment, atol=1e-3 * np.abs(moment).max())


def test_one_body_named_twice():
    for joint in (Cylindrical, Planar, Screw, Universal):
        more = {"lead": 0.1} if joint is Screw else {}
        more |= {"axis_i": (0.0, 0.0, 1.0), "axis_j": (1.0, 0.0, 0.0)} if joint is Universal else {}
        twice = joint(name="joint", body_i="first", body_j="first", **more)
        with pytest.raises(ModelError, match=f"{joint.kind} 'joint': Expected two different bodies, got 'first' twice"):
            Model(System(bodies=[wheel("first", 0.1)], constraints=[twice]))


def test_a_motor_on_what_is_no_joint():
    motor = JointMotor(name="motor", joint="rotor", input="torque")
    with pytest.raises(ModelError, match="joint_motor 'motor': 'rotor' is a rigid_body. Expected the name of a"):
        run(0.1, torque=1.0, bodies=[wheel("rotor", 0.1)], forces=[motor])

"""Ropes wound on drums against closed forms, and their mistakes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    DrumRope,
    Gravity,
    JointReaction,
    PathPoint,
    PointMass,
    Revolute,
    RigidBody,
    RopeSensor,
    Slider,
    System,
)
from dms_core.simulation.options import SolverOptions
from tests.dms_core.model.constraints.wheels import NEAR, TIGHT, axle, run, torque, turned, wheel


class TestDrumRope:
    M1, M2, J, R = 3.0, 1.0, 0.04, 0.1

    def atwood(self, time: float = 1.0, options: SolverOptions = TIGHT, **changes):
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
            options=options,
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

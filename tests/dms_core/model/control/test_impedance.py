"""A pendulum that two ropes hold compliantly: closed forms, energy, and gains that change within a run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    AngleDriver,
    Constant,
    Function,
    Gravity,
    ImpedanceController,
    Input,
    JointAngle,
    JointMoment,
    PathPoint,
    Revolute,
    RigidBody,
    RopeActuator,
    RopeForce,
    System,
)
from dms_core.model.control.impedance import moment_arm
from dms_core.results import Result
from dms_core.simulation.dynamics import SolverOptions, World, simulate

MASS, LENGTH, INERTIA, GRAVITY = 1.5, 0.15, 0.02, 9.80665
WEIGHT = MASS * GRAVITY * LENGTH
LAG, WIDTH, TURN = 0.002, 0.01, 0.8
ANCHOR, LEVER = np.array([0.15, 0.1]), np.array([0.03, -0.1])
TILTED = {"axis_i": (0.2, -0.1, 0.9), "axis_j": (0.2, -0.1, 0.9)}


def pendulum(angle=0.5, *more, gravity=True, K=20.0, D=1.0, s=0.0, hinge=None, ropes=("flexor", "extensor"), **law):
    """An arm of a hinge at the ground, which hangs at angle 0, with a law that two ropes follow."""
    given = {"stiffness": K, "damping": D, "share": s}
    forces = [Gravity(name="gravity")] if gravity else []
    for name, side in (("flexor", 1.0), ("extensor", -1.0)):
        path = (
            PathPoint(point=(side * ANCHOR[0], ANCHOR[1], 0.02)),
            PathPoint(body="arm", point=(side * LEVER[0], LEVER[1], 0.0)),
        )
        motor = RopeActuator(name=f"{name}_motor", rate_of=f"law.{name}_impulse", time_constant=LAG, width=WIDTH)
        forces += [motor, RopeForce(name=name, path=path, coordinate=f"{name}_motor.tension")]
    axis = np.array((hinge or {}).get("axis_i", (0.0, 0.0, 1.0)))
    p = (math.cos(0.5 * angle), *(math.sin(0.5 * angle) * axis / np.linalg.norm(axis)))
    return System(
        bodies=[
            RigidBody(
                name="arm", mass=MASS, inertia=(INERTIA,) * 3, centre_of_mass=(0.0, -LENGTH, 0.0), orientation=tuple(p)
            )
        ],
        constraints=[Revolute(name="hinge", body_j="arm", point_j=(0.0, 0.0, 0.0), **(hinge or {})), *more],
        forces=[
            *forces,
            ImpedanceController(
                name="law", joint="hinge", ropes=ropes, stiffness="stiffness", damping="damping", share="share", **law
            ),
        ],
        sensors=[
            JointAngle(name="angle", joint="hinge"),
            JointMoment(name="moment", joint="hinge", elements=("flexor", "extensor")),
        ],
        inputs=[*(Input(name=n, signal=Constant(value=x)) for n, x in given.items() if x is not None)]
        + [Input(name=c.input, signal=Function(function=lambda t: (angle + TURN * t, TURN, 0.0))) for c in more],
    )  # fmt: skip


def run(system, end, rtol=1e-6):
    """Sensors of a run by name."""
    return simulate(system, end, SolverOptions(rtol=rtol)).check().sensors()


@pytest.mark.parametrize("hinge", [None, TILTED])
def test_moment_arms_are_slopes_of_the_ropes_lengths(hinge):
    model = Model(pendulum(0.4, hinge=hinge))
    law = model.system.element("law").place(model.system)
    par = np.array(law.numbers)
    axis = np.array((hinge or {}).get("axis_i", (0.0, 0.0, 1.0)))
    axis = axis / np.linalg.norm(axis)

    def length(side, angle):
        a, x = np.array([side * ANCHOR[0], ANCHOR[1], 0.02]), np.array([side * LEVER[0], LEVER[1], 0.0])
        turned = x * math.cos(angle) + np.cross(axis, x) * math.sin(angle) + axis * (axis @ x) * (1 - math.cos(angle))
        return np.linalg.norm(turned - a)

    for k, side in enumerate((1.0, -1.0)):
        for angle in (-0.3, 0.4, 0.9):
            e = 1e-5
            arm, slope = moment_arm(par, k, angle)
            assert arm == pytest.approx(-(length(side, angle + e) - length(side, angle - e)) / (2 * e), abs=1e-9)
            other = (moment_arm(par, k, angle + e)[0] - moment_arm(par, k, angle - e)[0]) / (2 * e)
            assert slope == pytest.approx(other, abs=1e-9)


@pytest.mark.parametrize("K", [10.0, 40.0])
@pytest.mark.parametrize("s", [0.0, 0.4])
def test_at_rest_the_spring_carries_what_is_left_of_the_weight(K, s):
    found = run(pendulum(0.5, K=K, D=2.0, s=s, carried_sin=WEIGHT), 4.0)
    angle = found["angle.angle"][-1]
    assert abs(found["angle.rate"][-1]) < 1e-5
    # The motors' smoothing of 0.01 N is all that parts the ropes' moment from the law.
    assert K * (0.5 - angle) == pytest.approx((1.0 - s) * WEIGHT * math.sin(angle), abs=2e-4)
    assert 0.01 < 0.5 - angle < 0.1


def test_a_share_of_one_carries_the_arm_at_any_angle():
    for angle in (0.2, 0.6, 1.0):
        found = run(pendulum(angle, K=0.0, D=1.0, s=1.0, carried_sin=WEIGHT), 1.0)
        # The motors begin slack: until they have come, 0.002 s, the arm takes on 0.08 rad/s, which D ends in 0.05 s.
        assert np.ptp(found["angle.angle"]) < 0.01 and abs(found["angle.rate"][-1]) < 1e-4
        assert found["moment"][-1] == pytest.approx(WEIGHT * math.sin(found["angle.angle"][-1]), abs=1e-3)


@pytest.mark.parametrize("relaxation", [None, 0.05, 0.5])
@pytest.mark.parametrize("D", [0.3, 1.0])
def test_a_passive_law_takes_up_energy(relaxation, D):
    """Released from a wound spring, the energy of arm and spring never rises.

    The motors' lag T takes K T of the damping away, 20 x 0.002 = 0.04 N m s/rad, which is less than D.
    """
    start = Model(pendulum(0.3, gravity=False, K=20.0, D=D, relaxation_time=relaxation))
    world = World(start, SolverOptions(rtol=1e-7))
    index = world.model.layout.index
    energies, inertia = [], INERTIA + MASS * LENGTH**2
    # A spring that is wound when the run begins.
    world.state.q[index["law.zero"]] += 0.5
    for k in range(1, 200):
        assert world.advance(0.01 * k) is Result.SUCCESS, world.message
        angle, rate = world.read()[:2]
        stretch = world.state.q[index["law.zero"]] - angle
        energies.append(0.5 * inertia * rate**2 + 0.5 * 20.0 * stretch**2)
    # Smoothed ropes keep 1e-3 N of co-contraction, whose moments on unequal levers do some 1e-5 J of work.
    assert max(np.diff(energies)) < 2e-5, max(np.diff(energies))
    assert energies[0] > 1.0 and energies[-1] < 1e-3 * energies[0]


def test_a_zero_that_follows_is_the_slow_damper_of_a_zero_that_is_reset():
    """Turned with TURN rad/s by a driver. A spring that is reset each P gives K TURN P / 2 in the mean: T_0 = P / 2."""
    K, P = 50.0, 0.04
    driver = AngleDriver(name="driver", joint="hinge", input="course")
    found = run(pendulum(0.2, driver, gravity=False, K=K, D=0.0, relaxation_time=P / 2), 0.5)
    reset = [-K * TURN * t for t in np.linspace(0.0, P, 1001)]
    # Within the motors' lag the moment arms change by 2e-3 of themselves.
    assert found["moment"][-1] == pytest.approx(np.mean(reset), rel=4e-3)
    fixed = run(pendulum(0.2, driver, gravity=False, K=K, D=0.0), 0.5)
    lagging = -K * TURN * (0.5 - LAG)
    assert fixed["moment"][-1] == pytest.approx(lagging, rel=4e-3)
    slow = run(pendulum(0.2, driver, gravity=False, K=K, D=0.0, relaxation_time=1e4), 0.5)
    assert slow["moment"][-1] == pytest.approx(fixed["moment"][-1], rel=1e-4)


def test_a_law_that_becomes_nothing_goes_on():
    """Pivots that the run began with may be the damping; where it is set to 0 they are chosen at the present inputs."""
    world = World(Model(pendulum(0.3, K=20.0, D=3.0, s=1.0, carried_sin=WEIGHT)))
    assert world.advance(0.1) is Result.SUCCESS
    for name in ("stiffness", "damping", "share"):
        world.set_input(name, 0.0)
    assert world.advance(0.2) is Result.SUCCESS, world.message
    world.set_input("damping", 3.0)
    assert world.advance(0.3) is Result.SUCCESS, world.message


class TestMistakes:
    def refused(self, complaint, **changes):
        with pytest.raises(ModelError, match=complaint):
            Model(pendulum(**changes))

    def test_a_motor_of_a_rope_that_is_not_asked(self):
        self.refused("coordinate 'law.flexor_impulse' does not exist", ropes=("extensor",))

    def test_no_such_rope(self):
        law = ImpedanceController(name="law", joint="hinge", ropes=("cable",), stiffness="a", damping="b", share="c")
        with pytest.raises(ModelError, match="'cable' does not exist. Expected the name of a RopeForce. .*flexor"):
            law.place(pendulum())

    def test_no_rope(self):
        self.refused("ropes = .*at least 1", ropes=())

    def test_a_time_that_is_none(self):
        self.refused("relaxation_time = -1.0: Expected a number above 0", relaxation_time=-1.0)

    def test_a_joint_that_is_none(self):
        law = ImpedanceController(name="law", joint="arm", ropes=("r",), stiffness="a", damping="b", share="c")
        with pytest.raises(ModelError, match="'arm' is a rigid_body. Expected the name of a .*Revolute or Screw"):
            law.place(pendulum())

    def test_a_rope_beside_the_joint(self):
        path = tuple(PathPoint(body="arm", point=(0.1 * k, 0.0, 0.0)) for k in range(2))
        law = ImpedanceController(name="law", joint="hinge", ropes=("r",), stiffness="a", damping="b", share="c")
        rope = RopeForce(name="r", path=(*path, PathPoint(point=(0.0, 1.0, 0.0))), tension=1.0)
        system = System(
            bodies=[RigidBody(name="arm", mass=1.0, inertia=(0.1, 0.1, 0.1))],
            constraints=[Revolute(name="hinge", body_j="arm")], forces=[rope, law],
            inputs=[Input(name=n, signal=Constant(value=0.0)) for n in "abc"],
        )  # fmt: skip
        with pytest.raises(
            ModelError, match="rope 'r' runs through arm, arm, ground; expected two points, one on each"
        ):
            Model(system)

    @pytest.mark.parametrize("given", [{}, {"pid": "p", "rate_of": "law.x"}, {"command": "c", "rate_of": "law.x"}])
    def test_a_motor_of_no_or_several_sources(self, given):
        with pytest.raises(ModelError, match="give one of 'command'.*'pid' and 'rate_of'"):
            RopeActuator(name="motor", time_constant=0.01, **given)

    def test_a_motor_of_an_unknown_coordinate(self):
        with pytest.raises(ModelError, match="law.x"):
            Model(System(
                bodies=[RigidBody(name="arm", mass=1.0, inertia=(0.1, 0.1, 0.1))],
                forces=[RopeActuator(name="motor", time_constant=0.01, rate_of="law.x")],
            ))  # fmt: skip

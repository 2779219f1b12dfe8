"""Impacts against closed forms: restitution of the law, a bouncing ball, two balls; energy without damping."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    ContactSensor,
    CylinderContact,
    Gravity,
    Input,
    PointMass,
    RigidBody,
    SphereContact,
    SpherePairContact,
    System,
)
from dms_core.model.contact.law import damping_number
from dms_core.simulation.dynamics import Simulation, SolverOptions, World, simulate
from dms_core.simulation.events import Crossing, advance_with_impacts

MASS, STIFFNESS, G = 0.7, 2e6, 9.81
FINE = SolverOptions(rtol=1e-9)
"""Of impacts: some thousand steps, each of an error below 1e-10 of the values."""


def after(speed: float, d: float, at: float) -> float:
    """Speed after an impact at `speed`, of a contact with damping number d at the speed `at`, from the first integral.

    m v dv / (1 + D v) = -k x^(3/2) dx has the same right side in and out:
    a v - ln(1 + a v) at v = speed and at v = -out, with a = d / at.
    """
    a = d / at

    def part(v: float) -> float:
        return a * v - math.log1p(a * v)

    return brentq(lambda out: part(-out) - part(speed), 0.0, (1.0 - 1e-13) / a, xtol=1e-15)


def ball(speed: float, height: float = 1e-3, gravity: float = 0.0, **contact) -> System:
    """A point mass that falls along -y onto the ground."""
    mass = PointMass(name="ball", mass=MASS, position=(0.0, height, 0.0), velocity=(0.0, -speed, 0.0))
    touch = SphereContact(name="touch", body_j="ball", **{"stiffness": STIFFNESS, **contact})
    inputs = [Input(name="speed")] if "impact_speed_input" in contact else []
    return System(
        "ball", bodies=[mass], forces=[touch, Gravity(name="weight", acceleration=(0.0, -gravity, 0.0))],
        sensors=[ContactSensor(name="touch_sensor", contact="touch")], inputs=inputs,
    )  # fmt: skip


@pytest.mark.parametrize("restitution", [0.05, 0.2, 0.5, 0.8, 0.99, 1.0 - 1e-9])
def test_the_damping_number_solves_its_equation(restitution):
    d = damping_number(restitution)
    assert math.log1p(d) - math.log1p(-restitution * d) == pytest.approx(d * (1.0 + restitution), rel=1e-12, abs=1e-8)
    # Near e = 1, d is 3/2 (1 - e): Hunt and Crossley's own relation for slow impacts.
    if restitution > 0.9:
        assert d == pytest.approx(1.5 * (1.0 - restitution), rel=2.0 * (1.0 - restitution) + 1e-7)


@pytest.mark.parametrize("restitution", [0.1, 0.35, 0.7, 0.95])
@pytest.mark.parametrize("speed", [0.3, 2.5])
def test_an_impact_at_its_speed_gives_back_exactly_the_restitution(restitution, speed):
    system = ball(speed, restitution=restitution, impact_speed=speed)
    run = simulate(system, 2e-3 / speed + 0.02, FINE).check()
    assert run.v[-1, 1] / speed == pytest.approx(restitution, rel=2e-6)
    assert run.q[-1, 1] > 0.0


def test_impacts_at_other_speeds_follow_the_first_integral():
    d = damping_number(0.6)
    for speed in (0.5, 1.0, 4.0):
        run = simulate(ball(speed, restitution=0.6, impact_speed=1.0), 2e-3 / speed + 0.02, FINE).check()
        assert run.v[-1, 1] == pytest.approx(after(speed, d, 1.0), rel=3e-6)
    assert after(1.0, d, 1.0) == pytest.approx(0.6, rel=1e-12)


def test_an_elastic_ball_bounces_with_the_period_of_flight_and_contact():
    """Touch-downs are events; between two of them lie a flight and an impact, whose time is an integral."""
    height = 0.8
    speed = math.sqrt(2.0 * G * height)

    def room(x: float) -> float:
        return speed**2 + 2.0 * G * x - 0.8 * STIFFNESS / MASS * x**2.5

    deepest = brentq(room, 1e-6, 1.0, xtol=1e-16)
    # x = deepest (1 - s^2) takes the root at the end out of the integrand.
    contact, _ = quad(lambda s: 4.0 * deepest * s / math.sqrt(room(deepest * (1.0 - s * s))), 0.0, 1.0, epsrel=1e-11)
    world = World(Model(ball(0.0, height, G)), SolverOptions(rtol=1e-8))
    times = []
    for _ in range(3):
        assert world.advance(10.0, stop_at=Crossing("touch_sensor.gap")).name == "SUCCESS"
        assert world.crossing == Crossing("touch_sensor.gap")
        assert abs(world.read()[0]) < 1e-12
        times.append(world.time)
    # The fall is a parabola, which a method of order 2 solves to rounding; its end is located.
    assert times[0] == pytest.approx(speed / G, rel=1e-7)
    assert np.diff(times) == pytest.approx(2.0 * speed / G + contact, rel=1e-6)


def _touch_downs(stiffness: float, restitution: float, height: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Times of the touch-downs and heights between them, each impact with the restitution."""
    model = Model(ball(0.0, height, G, restitution=restitution, impact_speed_input="speed", stiffness=stiffness))
    world = Simulation(model, SolverOptions(rtol=1e-7))
    times, tops = [], []
    while len(times) < count:
        world.advance(10.0, stop_at=[Crossing("touch_sensor.gap"), Crossing("touch_sensor.rate")])
        if world.crossing.sensor == "touch_sensor.gap":
            times.append(world.time)
            world.set_input("speed", -float(world.state.v[1]))
        elif world.state.q[1] > 0.0:
            tops.append(float(world.state.q[1]))
    return np.array(times), np.array(tops)


def test_a_bouncing_ball_has_the_times_and_heights_of_the_textbook():
    """h_k = e^(2 k) h and t_k = sqrt(2 h / g) (1 + 2 (e + ... + e^k)): the limit of a rigid ground.

    An impact takes a time proportional to k^(-2/5), by which the touch-downs are late, and its weight acts through it.
    """
    e, height, k = 0.7, 0.5, np.arange(5)
    exact = math.sqrt(2.0 * height / G) * (1.0 + 2.0 * np.cumsum(np.where(k > 0, e**k, 0.0)))
    late, low = [], []
    for stiffness in (1e7, 3.2e8):
        times, tops = _touch_downs(stiffness, e, height, 5)
        late.append(times - exact)
        low.append(tops - e ** (2 * k[1:]) * height)
    assert np.abs(low[1]).max() < 2e-3 * height
    assert np.abs(late[1]).max() < 2e-3
    # Thirty-two times the stiffness is a quarter of the time in contact, and of the depth through which weight acts.
    assert late[0][1:] / late[1][1:] == pytest.approx(4.0, rel=0.05)
    assert low[0] / low[1] == pytest.approx(4.0, rel=0.05)


def test_every_impact_gets_its_speed_from_its_touch_down():
    model = Model(ball(0.0, 0.5, G, restitution=0.6, impact_speed_input="speed", stiffness=1e8))
    world = Simulation(model, SolverOptions(rtol=1e-7))
    assert advance_with_impacts(world, 1.0, {"touch_sensor": "speed"}).name == "SUCCESS"
    heights = world.trajectory().at(np.linspace(0.0, 1.0, 2001)).coordinate("ball.y")
    tops = heights[1:-1][(heights[1:-1] > heights[:-2]) & (heights[1:-1] >= heights[2:]) & (heights[1:-1] > 0.0)]
    # Depth over height, through which weight acts in an impact, is 2e-3 to 6e-3 here, and its loss adds up.
    assert tops / 0.5 == pytest.approx([0.36, 0.1296], rel=2e-2)


def test_two_balls_keep_their_momentum_and_part_with_the_restitution():
    a = RigidBody(name="a", mass=0.5, inertia=(1e-3,) * 3, position=(-0.3, 0.0, 0.0), velocity=(2.0, 0.0, 0.0))
    b = RigidBody(name="b", mass=1.5, inertia=(1e-3,) * 3, position=(0.3, 0.0, 0.0), velocity=(-1.0, 0.0, 0.0))
    touch = SpherePairContact(
        name="touch", body_i="a", body_j="b", radius_i=0.1, radius_j=0.2, stiffness=1e7, restitution=0.4,
        impact_speed=3.0, friction=0.3,
    )  # fmt: skip
    run = simulate(System("balls", bodies=[a, b], forces=[touch]), 0.2, SolverOptions(rtol=1e-8)).check()
    va, vb = run.at(0.2).coordinate("a.x"), run.v[-1]
    assert 0.5 * run.v[-1, 0] + 1.5 * run.v[-1, 7] == pytest.approx(0.5 * 2.0 - 1.5, abs=1e-9)
    assert run.v[-1, 7] - run.v[-1, 0] == pytest.approx(0.4 * 3.0, rel=1e-5)
    assert np.abs(vb[[1, 2, 8, 9]]).max() < 1e-12 and va < -0.1


def test_energy_is_kept_where_nothing_damps():
    """A body that tumbles off its centre onto a tilted plane, without damping and friction."""
    body = RigidBody(
        name="body", mass=1.2, inertia=(0.02, 0.03, 0.01), position=(0.0, 0.6, 0.0), angular_velocity=(2.0, 1.0, -3.0),
        velocity=(0.4, 0.0, 0.0),
    )  # fmt: skip
    plane = {"body_j": "body", "normal_i": (0.2, 1.0, 0.1), "stiffness": 1e5}
    forces = [
        SphereContact(name="one", centre_j=(0.2, 0.1, 0.0), radius=0.1, **plane),
        CylinderContact(name="two", centre_j=(0.0, -0.1, 0.0), axis_j=(0.0, 0.3, 1.0), radius=0.1, length=0.2, **plane),
        Gravity(name="weight", acceleration=(0.0, -G, 0.0)),
    ]
    sensors = [
        ContactSensor(name=f"s{k}", contact=c, end=e) for k, (c, e) in enumerate((("one", 0), ("two", 0), ("two", 1)))
    ]
    model = Model(System("tumble", bodies=[body], forces=forces, sensors=sensors))
    run = simulate(model, 1.0, SolverOptions(rtol=1e-8)).check()
    y = run.sensors(run.t)
    touched = sum(0.4 * 1e5 * np.maximum(-y[f"s{k}.gap"], 0.0) ** 2.5 for k in range(3))
    q, v = run.q, run.v
    p, pd = q[:, 3:], v[:, 3:]
    # omega in body axes, 2 G pdot.
    w = 2.0 * np.stack([
        -p[:, 1] * pd[:, 0] + p[:, 0] * pd[:, 1] + p[:, 3] * pd[:, 2] - p[:, 2] * pd[:, 3],
        -p[:, 2] * pd[:, 0] - p[:, 3] * pd[:, 1] + p[:, 0] * pd[:, 2] + p[:, 1] * pd[:, 3],
        -p[:, 3] * pd[:, 0] + p[:, 2] * pd[:, 1] - p[:, 1] * pd[:, 2] + p[:, 0] * pd[:, 3],
    ], axis=1)  # fmt: skip
    energy = 0.6 * (v[:, :3] ** 2).sum(1) + 0.5 * (w**2 @ np.array([0.02, 0.03, 0.01])) + 1.2 * G * q[:, 1] + touched
    assert touched.max() > 1.0
    # The disc's deepest point, passed to its centre where it lies flat, costs a share of FLAT.
    assert np.ptp(energy) < 2e-5 * energy[0]


WRONG = {
    "restitution below 0": ({"restitution": -0.1}, "restitution = -0.1: Expected a number above 0"),
    "restitution 0": ({"restitution": 0.0}, "restitution = 0.0: Expected a number above 0"),
    "restitution above 1": ({"restitution": 1.2}, "restitution = 1.2: Expected a number of at most 1"),
    "no stiffness": ({"stiffness": 0.0}, "stiffness = 0.0: Expected a number above 0"),
    "friction below 0": ({"friction": -0.2}, "friction = -0.2: Expected a number of at least 0"),
    "no slip speed": ({"slip_speed": 0.0}, "slip_speed = 0.0: Expected a number above 0"),
    "radius below 0": ({"radius": -1.0}, "radius = -1.0: Expected a number of at least 0"),
    "impact speed 0": ({"impact_speed": 0.0}, "impact_speed = 0.0: Expected a number above 0"),
}


@pytest.mark.parametrize("change, complaint", WRONG.values(), ids=WRONG)
def test_wrong_numbers_are_refused(change, complaint):
    with pytest.raises(ModelError, match=complaint):
        SphereContact(**{"name": "touch", "body_j": "ball", "stiffness": 1.0, **change})


def test_wrong_contacts_are_refused():
    with pytest.raises(ModelError, match="sphere_contact 'touch': normal_i = .* has length 0"):
        Model(ball(0.0, normal_i=(0.0, 0.0, 0.0)))
    with pytest.raises(ModelError, match="sphere_contact 'touch': .*two different bodies, got 'ball' twice"):
        Model(ball(0.0, body_i="ball"))
    with pytest.raises(ModelError, match="input 'speed' does not exist"):
        Model(System("x", bodies=[PointMass(name="ball", mass=1.0)], forces=[
            SphereContact(name="touch", body_j="ball", stiffness=1.0, impact_speed_input="speed")]))  # fmt: skip
    with pytest.raises(ModelError, match="two points never touch"):
        SpherePairContact(name="touch", body_j="ball", radius_i=0.0, radius_j=0.0, stiffness=1.0)
    with pytest.raises(
        ModelError, match="contact_sensor 's': 'weight' is a gravity. Expected the name of a CylinderContact"
    ):
        Model(System("x", bodies=[PointMass(name="ball", mass=1.0)], forces=[Gravity(name="weight")],
                     sensors=[ContactSensor(name="s", contact="weight")]))  # fmt: skip

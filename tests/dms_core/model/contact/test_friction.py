"""Friction of contacts against closed forms of the regularised law, and their limit of Coulomb."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from dms_core.assembly.model import Model
from dms_core.model import CylinderContact, Gravity, PointMass, RigidBody, SphereContact, System
from dms_core.simulation.dynamics import SolverOptions, simulate

G, MU, SLIP = 9.81, 0.3, 1e-3
STIFFNESS = 1e7


def rest_depth(load: float) -> float:
    """Depth at which a contact carries a load at rest [m]."""
    return (load / STIFFNESS) ** (2.0 / 3.0)


def on_slope(angle: float, speed: float, mass: float = 2.0) -> Model:
    """A point that slides down a slope, at rest across it."""
    n, down = (math.sin(angle), math.cos(angle), 0.0), np.array([math.cos(angle), -math.sin(angle), 0.0])
    depth = rest_depth(mass * G * math.cos(angle))
    block = PointMass(name="block", mass=mass, position=tuple(-depth * np.array(n)), velocity=tuple(speed * down))
    touch = SphereContact(
        name="touch", body_j="block", normal_i=n, stiffness=STIFFNESS, restitution=0.5, friction=MU, slip_speed=SLIP
    )
    return Model(System("slope", bodies=[block], forces=[touch, Gravity(name="weight", acceleration=(0.0, -G, 0.0))]))


def test_a_point_slides_to_rest_after_the_way_of_the_law():
    """v dv / ds = -mu g v / sqrt(v^2 + s0^2) integrates in closed form; without s0 it is v^2 / (2 mu g)."""
    v = 1.5
    root = math.sqrt(v * v + SLIP * SLIP)
    way = (v * root + SLIP**2 * math.asinh(v / SLIP)) / (2.0 * MU * G)
    run = simulate(on_slope(0.0, v), 1.0, SolverOptions(rtol=1e-7)).check()
    assert run.q[-1, 0] == pytest.approx(way, rel=1e-6)
    assert way == pytest.approx(v**2 / (2.0 * MU * G), rel=2e-5)
    assert abs(run.v[-1, 0]) < 1e-9


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_below_the_angle_of_friction_it_creeps_as_stated(share):
    angle = math.atan(share * MU)
    creep = SLIP * math.tan(angle) / math.sqrt(MU**2 - math.tan(angle) ** 2)
    run = simulate(on_slope(angle, 0.5), 4.0, SolverOptions(rtol=1e-7)).check()
    assert math.hypot(*run.v[-1, :2]) == pytest.approx(creep, rel=1e-5)


def test_above_it_it_slides_down():
    angle = math.atan(2.0 * MU)
    run = simulate(on_slope(angle, 0.0), 1.0, SolverOptions(rtol=1e-7)).check()
    speed = math.hypot(*run.v[-1, :2])
    time, _ = quad(
        lambda v: 1.0 / (G * math.sin(angle) - MU * G * math.cos(angle) * v / math.hypot(v, SLIP)),
        0.0, speed, points=[SLIP, 10.0 * SLIP], epsabs=1e-10, limit=200,
    )  # fmt: skip
    assert time == pytest.approx(1.0, rel=1e-6)
    assert speed == pytest.approx(G * (math.sin(angle) - MU * math.cos(angle)), rel=1e-3)


def test_a_block_on_four_points_slides_to_rest():
    """Friction at its foot tilts it a little and shifts load forwards; all of its weight rubs all the same."""
    v, mass, half, high = 1.5, 3.0, 0.1, 0.05
    depth = rest_depth(mass * G / 4.0)
    block = RigidBody(
        name="block", mass=mass, inertia=(0.012, 0.02, 0.012), position=(0.0, high - depth, 0.0), velocity=(v, 0.0, 0.0)
    )
    feet = [
        SphereContact(
            name=f"foot{k}", body_j="block", centre_j=(x, -high, z), stiffness=STIFFNESS, restitution=0.1,
            impact_speed=0.01, friction=MU, slip_speed=SLIP,
        )
        for k, (x, z) in enumerate([(half, half), (half, -half), (-half, half), (-half, -half)])
    ]  # fmt: skip
    weight = Gravity(name="weight", acceleration=(0.0, -G, 0.0))
    run = simulate(System("block", bodies=[block], forces=[*feet, weight]), 0.8, SolverOptions(rtol=1e-6)).check()
    # The tilt, some 1e-5 rad, turns the foot's way by as much; the weight's oscillation behind the start averages out.
    assert run.q[-1, 0] == pytest.approx(v**2 / (2.0 * MU * G), rel=1e-4)
    assert np.abs(run.q[-1, [2, 4, 5]]).max() < 1e-9


def rolling(shape: str, inertia: float, angle: float, speed: float) -> Model:
    """A ball or a cylinder about z on a slope, pushed without turning."""
    mass, radius = 1.4, 0.1
    n = np.array([math.sin(angle), math.cos(angle), 0.0])
    down = np.array([math.cos(angle), -math.sin(angle), 0.0])
    depth = rest_depth(mass * G * math.cos(angle) / (1.0 if shape == "ball" else 2.0))
    about = inertia * mass * radius**2
    body = RigidBody(
        name="body", mass=mass, inertia=(about,) * 3, position=tuple((radius - depth) * n), velocity=tuple(speed * down)
    )
    law = {"name": "touch", "body_j": "body", "normal_i": tuple(n), "radius": radius, "stiffness": STIFFNESS,
           "restitution": 0.5, "friction": MU, "slip_speed": SLIP}  # fmt: skip
    touch = SphereContact(**law) if shape == "ball" else CylinderContact(length=0.3, **law)
    return Model(System(shape, bodies=[body], forces=[touch, Gravity(name="weight", acceleration=(0.0, -G, 0.0))]))


def spin(run, k: int) -> float:
    """Angular velocity about z at step k, of a body that turns about z alone [rad/s]."""
    p, pd = run.q[k, 3:], run.v[k, 3:]
    return 2.0 * (p[0] * pd[3] - p[3] * pd[0])


def test_a_ball_slides_and_then_rolls_with_five_sevenths_of_its_speed():
    """Its angular momentum about the foot is kept; the time of sliding is 2 v / (7 mu g)."""
    v, radius = 2.0, 0.1
    run = simulate(rolling("ball", 0.4, 0.0, v), 1.0, SolverOptions(rtol=1e-7)).check()
    lever = radius - rest_depth(1.4 * G)
    assert run.v[-1, 0] == pytest.approx(v / (1.0 + 0.4 * (radius / lever) ** 2), rel=1e-6)
    assert run.v[-1, 0] == pytest.approx(5.0 / 7.0 * v, rel=1e-3)
    assert run.v[-1, 0] == pytest.approx(-spin(run, -1) * lever, rel=1e-6)
    end = 2.0 * v / (7.0 * MU * G)
    k = int(np.argmin(np.abs(run.t - 0.5 * end)))
    assert run.v[k, 0] == pytest.approx(v - MU * G * run.t[k], rel=1e-4)
    slip = np.array([run.v[k, 0] + spin(run, k) * lever for k in range(len(run.t))])
    assert np.all(slip[run.t > end + 0.01] < 5e-3) and np.all(slip[run.t < end - 0.01] > 0.05)


@pytest.mark.parametrize(("shape", "inertia"), [("ball", 0.4), ("cylinder", 0.5)])
def test_it_rolls_down_a_slope_with_the_acceleration_of_the_textbook(shape, inertia):
    """g sin a / (1 + I / (m R^2)): 5/7 for a ball, 2/3 for a cylinder."""
    angle = math.radians(15.0)
    run = simulate(rolling(shape, inertia, angle, 0.0), 1.0, SolverOptions(rtol=1e-7)).check()
    speed = math.hypot(*run.v[-1, :2])
    # At the start it slips until friction holds it: a few slip speeds of what 1 s gives.
    assert speed == pytest.approx(G * math.sin(angle) / (1.0 + inertia), rel=2e-3)
    k = int(np.argmin(np.abs(run.t - 0.5)))
    gained = (speed - math.hypot(*run.v[k, :2])) / (run.t[-1] - run.t[k])
    lever = 0.1 - rest_depth(1.4 * G * math.cos(angle) / (1.0 if shape == "ball" else 2.0))
    assert gained == pytest.approx(G * math.sin(angle) / (1.0 + inertia * (0.1 / lever) ** 2), rel=1e-5)

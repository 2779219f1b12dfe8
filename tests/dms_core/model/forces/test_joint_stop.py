"""A joint stop against Hunt and Crossley's law: impact, rest, energy, order of the method; and its declaration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import Gravity, JointAngle, JointStop, Revolute, RigidBody, System
from dms_core.results import Trajectory
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.dms_core.model.poses import block_rate, start
from tests.example_elements import Example
from tests.example_elements.kernel_call import kernel_calls
from tests.example_elements.pair import pair

MASS, LEVER, ABOUT = 1.2, 0.25, 0.02
INERTIA = ABOUT + MASS * LEVER**2
"""Of the pendulum about its hinge [kg m^2]."""
STIFFNESS = 150.0
RTOL = 1e-8
"""Of the runs: some thousand steps through an impact, errors of 1e-6 in the angle and 1e-5 in its rate."""


def pendulum(rate: float = 0.0, angle: float = 0.0, gravity: float = 0.0, **stop) -> Model:
    """A body on a hinge about z, its centre of mass along x at angle 0, between stops at -0.5 and 0.5 rad."""
    c, s = math.cos(angle), math.sin(angle)
    body = RigidBody(
        name="bob", mass=MASS, inertia=(0.01, 0.01, ABOUT), position=(LEVER * c, LEVER * s, 0.0),
        orientation=(math.cos(angle / 2.0), 0.0, 0.0, math.sin(angle / 2.0)),
        velocity=(-rate * LEVER * s, rate * LEVER * c, 0.0), angular_velocity=(0.0, 0.0, rate),
    )  # fmt: skip
    hinge = Revolute(name="hinge", body_j="bob", axis_i=(0.0, 0.0, 1.0), axis_j=(0.0, 0.0, 1.0))
    declared = JointStop(name="stop", joint="hinge", lowest=-0.5, highest=0.5, stiffness=STIFFNESS, **stop)
    forces = [Gravity(name="weight", acceleration=(0.0, -gravity, 0.0)), declared]
    sensors = [JointAngle(name="angle", joint="hinge")]
    return Model(System("stop", bodies=[body], constraints=[hinge], forces=forces, sensors=sensors))


def angles(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Angle and rate at the steps [rad, rad/s]."""
    y = run.sensors(run.t)
    return y["angle.angle"], y["angle.rate"]


def after_impact(rate: float, dissipation: float) -> float:
    """Rate after an impact at a rate, both as sizes: a (vi + vo) = ln((1 + a vi) / (1 - a vo)) [rad/s]."""
    a = 1.5 * dissipation
    return brentq(lambda vo: a * (rate + vo) - math.log((1.0 + a * rate) / (1.0 - a * vo)), 0.0, (1.0 - 1e-12) / a)


@pytest.mark.parametrize("rate", [2.0, -2.0])
def test_without_dissipation_the_energy_comes_back(rate):
    run = simulate(pendulum(rate), 0.8, SolverOptions(rtol=RTOL)).check()
    angle, rates = angles(run)
    assert rates[-1] == pytest.approx(-rate, abs=1e-4)
    # All of it is in the stop where the body turns: I w^2 / 2 = 2/5 k x^(5/2).
    deepest = (1.25 * INERTIA * rate**2 / STIFFNESS) ** 0.4
    assert np.abs(angle).max() == pytest.approx(0.5 + deepest, abs=1e-5)


@pytest.mark.parametrize("rate", [0.5, 2.0, -6.0])
@pytest.mark.parametrize("dissipation", [0.02, 0.3, 2.0])
def test_restitution_is_that_of_the_law(rate, dissipation):
    run = simulate(pendulum(rate, dissipation=dissipation), 0.5 / abs(rate) + 0.5, SolverOptions(rtol=RTOL)).check()
    angle, rates = angles(run)
    touched = int(np.argmax(np.abs(angle) > 0.5))
    left = touched + int(np.argmax(np.abs(angle[touched:]) < 0.5))
    assert 0 < touched < left
    # The rate is constant between the stops; the impact is some hundred steps.
    assert rates[left] == pytest.approx(-math.copysign(after_impact(abs(rate), dissipation), rate), rel=1e-3)


def test_a_small_dissipation_is_the_slope_of_restitution():
    """Hunt and Crossley's own relation for slow impacts, e = 1 - c v; what is left is of the second order in c v."""
    for product in (0.01, 0.02, 0.04):
        run = simulate(pendulum(1.0, dissipation=product), 1.2, SolverOptions(rtol=RTOL)).check()
        assert -angles(run)[1][-1] == pytest.approx(1.0 - product, abs=product**2 + 1e-4)


@pytest.mark.parametrize("gravity", [9.81, -9.81])
def test_a_pendulum_comes_to_rest_where_its_weight_is_held(gravity):
    run = simulate(pendulum(angle=-0.4, gravity=gravity, dissipation=1.0), 20.0, SolverOptions(rtol=1e-6)).check()
    angle, rates = angles(run)
    depth = brentq(lambda x: STIFFNESS * x**1.5 - MASS * 9.81 * LEVER * math.cos(0.5 + x), 0.0, 1.0)
    assert angle[-1] == pytest.approx(-math.copysign(0.5 + depth, gravity), abs=1e-6)
    assert abs(rates[-1]) < 1e-6


def test_order_two_through_an_impact():
    """The moment and its slope begin at 0, so the touch costs no order."""
    model = pendulum(2.0, dissipation=0.3)
    exact = simulate(model, 0.5, SolverOptions(rtol=1e-10)).check()
    assert abs(angles(exact)[0][-1]) < 0.5 < np.abs(angles(exact)[0]).max()
    errors = [
        float(np.abs(simulate(model, 0.5, SolverOptions(fixed_step=h, rtol=1e-10)).check().q[-1] - exact.q[-1]).max())
        for h in (1e-3, 5e-4, 2.5e-4)
    ]
    assert np.all(np.abs(np.log2(np.array(errors[:-1]) / errors[1:]) - 2.0) < 0.2), errors


def _moment(angle: float, rate: float, **stop) -> float:
    """Moment against a positive turn of a hinge about z [N m], from the kernel's rows."""
    hinge = Revolute(name="hinge", body_j="lower", axis_i=(0.0, 0.0, 1.0), axis_j=(0.0, 0.0, 1.0))
    element = JointStop(name="stop", joint="hinge", stiffness=8.0, dissipation=0.5, **stop)
    (call,) = kernel_calls(Example(pair(constraints=[hinge], forces=[element]), element))
    x = start(call)
    x.q[10:] = (math.cos(angle / 2.0), 0.0, 0.0, math.sin(angle / 2.0))
    about = block_rate(x.q[7:], x.q[7:10], np.zeros(3), np.array([0.0, 0.0, 1.0]))
    x.v[7:] = rate * about
    return float(call(x)[0][7:] @ about)


@pytest.mark.parametrize(
    ("angle", "rate", "depth"),
    [(1.5, 0.0, 0.3), (1.5, 2.0, 0.3), (1.5, -1.0, 0.3), (-0.6, 2.0, -0.4), (-0.6, -2.0, -0.4), (0.5, 9.0, 0.0),
     (3.1, 0.0, 1.9), (-2.3, 0.0, -2.1), (-2.7, 0.0, 2.0 * math.pi - 3.9)],
)  # fmt: skip
def test_the_nearer_stop_acts_and_the_angle_has_no_jump_between_turns(angle, rate, depth):
    way = math.copysign(1.0, depth)
    wanted = way * 8.0 * abs(depth) ** 1.5 * max(1.0 + 0.75 * way * rate, 0.0)
    assert _moment(angle, rate, lowest=-0.2, highest=1.2) == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_a_stop_never_pulls():
    assert _moment(1.5, -1.3, lowest=-0.2, highest=1.2) > 0.0
    assert _moment(1.5, -1.4, lowest=-0.2, highest=1.2) == 0.0
    assert _moment(-0.5, 50.0, lowest=-0.2, highest=1.2) == 0.0


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"lowest": 1.0, "highest": 1.0}, "lowest = 1, highest = 1: expected the lowest angle below the highest"),
        ({"lowest": 0.5, "highest": -0.5}, "lowest = 0.5, highest = -0.5: expected the lowest angle below"),
        ({"lowest": 0.0, "highest": 6.3}, "less than a turn"),
        ({"stiffness": 0.0}, "stiffness"),
        ({"stiffness": -5.0}, "stiffness"),
        ({"dissipation": -0.1}, "dissipation"),
        ({"lowest": "low"}, "lowest"),
        ({"lowest": math.nan}, "lowest"),
    ],
)
def test_a_wrong_stop_is_refused(change, complaint):
    given = {"name": "end", "joint": "hinge", "lowest": -0.5, "highest": 0.5, "stiffness": 8.0} | change
    with pytest.raises(ModelError, match=complaint) as caught:
        JointStop(**given)
    assert "end" in str(caught.value)

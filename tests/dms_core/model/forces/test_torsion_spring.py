"""A torsion spring of several turns against closed forms, and the curve of a load against SciPy's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from dms_core.errors import ModelError
from dms_core.model import JointSpringDamper, LoadCurve, TorsionSpring
from dms_core.model.forces.load_curve import curve_load
from tests.dms_core.model.constraints.wheels import NEAR, axle, run, torque, turned, wheel

J = 0.02
ROTOR = wheel("rotor", J)


def spun(time: float, rate: float = 0.0, **spring):
    """A wheel on a torsion spring, with a rate at the start [rad/s]."""
    rotor = wheel("rotor", J, angular_velocity=(0.0, 0.0, rate))
    coil = TorsionSpring(name="coil", joint="rotor_axle", **spring)
    return run(time, bodies=[rotor], constraints=[axle(rotor)], forces=[coil])


def test_a_swing_of_many_turns():
    """theta = (w0 / w) sin(w t), w = sqrt(k / J), an amplitude of five turns: beyond pi nothing jumps."""
    w = math.sqrt(0.05 / J)
    amplitude = 10.0 * math.pi
    found = spun(5.0, amplitude * w, stiffness=0.05)
    np.testing.assert_allclose(turned(found, "rotor"), amplitude * np.sin(w * found.t), atol=1e-4 * amplitude)


def test_a_spring_that_is_wound_already():
    """Released from three turns of twist: theta = A (cos(w t) - 1)."""
    w, twist = math.sqrt(0.05 / J), 6.0 * math.pi
    found = spun(4.0, stiffness=0.05, rest_angle=-twist)
    np.testing.assert_allclose(turned(found, "rotor"), twist * (np.cos(w * found.t) - 1.0), atol=1e-4 * twist)


def test_energy_gives_the_turning_points_of_a_curve():
    """J w0^2 / 2 = integral of the curve up to the largest twist; a curve that is not the same both ways."""
    curve = LoadCurve(deflections=(-12.0, -3.0, 0.0, 4.0, 15.0), loads=(-5.0, -2.0, 0.0, 0.4, 9.0))
    found = spun(8.0, 20.0, curve=curve)
    energy = PchipInterpolator(curve.deflections, curve.loads).antiderivative()
    stored = lambda x: float(energy(x) - energy(0.0)) - 0.5 * J * 20.0**2  # noqa: E731
    turn = turned(found, "rotor")
    assert turn.max() > 2.0 * math.pi
    assert turn.max() == pytest.approx(brentq(stored, 0.0, 15.0), rel=1e-4)
    assert turn.min() == pytest.approx(brentq(stored, -12.0, 0.0), rel=1e-4)


def test_a_motor_against_a_spring_and_a_damper_comes_to_rest_where_the_curve_says():
    curve = LoadCurve(deflections=(0.0, 5.0, 10.0), loads=(0.0, 1.0, 4.0))
    coil = TorsionSpring(name="coil", joint="rotor_axle", curve=curve, damping=0.3)
    found = run(20.0, torque=3.0, bodies=[ROTOR], constraints=[axle(ROTOR)], forces=[coil, torque("rotor_axle")])
    # A monotone cubic is not linear between its points: where it is 3 is SciPy's to say.
    at = brentq(lambda x: float(PchipInterpolator(curve.deflections, curve.loads)(x)) - 3.0, 5.0, 10.0)
    assert turned(found, "rotor")[-1] == pytest.approx(at, rel=1e-4)


def test_spin_up_of_a_motor_against_friction():
    """w = M / c (1 - e^(-c t / J)), and its integral over many turns."""
    c, moment = 0.03, 3.0
    friction = JointSpringDamper(name="friction", joint="rotor_axle", damping=c)
    found = run(2.0, torque=moment, bodies=[ROTOR], constraints=[axle(ROTOR)], forces=[friction, torque("rotor_axle")])
    t, tau = found.t, J / c
    expected = moment / c * (t - tau * (1.0 - np.exp(-t / tau)))
    assert expected[-1] > 20.0 * 2.0 * math.pi
    np.testing.assert_allclose(turned(found, "rotor"), expected, atol=3.0 * NEAR * expected[-1])


@pytest.mark.parametrize("x", [-9.0, -2.0, -1.3, 0.0, 0.2, 1.0, 2.9, 3.0, 7.0])
def test_the_curve_is_that_of_scipy_and_straight_beyond_its_ends(x):
    curve = LoadCurve(deflections=(-2.0, -1.0, 0.0, 1.0, 3.0), loads=(-7.0, -1.0, 0.0, 0.1, 5.0))
    reference = PchipInterpolator(curve.deflections, curve.loads)
    near = min(max(x, -2.0), 3.0)
    slope = float(reference.derivative()(near))
    load, stiffness = curve_load(np.array([9.0, *curve.table()]), 1, x)
    assert load == pytest.approx(float(reference(near)) + slope * (x - near), abs=1e-12)
    assert stiffness == pytest.approx(slope, abs=1e-12)


def test_points_of_a_line_make_a_line():
    table = np.array(LoadCurve(deflections=(-1.0, 0.5, 4.0), loads=(-2.0, 1.0, 8.0)).table())
    for x in np.linspace(-5.0, 5.0, 23):
        assert curve_load(table, 0, x) == pytest.approx((2.0 * x, 2.0), abs=1e-12)


MISTAKES = {
    "no law": (lambda: TorsionSpring(name="s", joint="j"), "neither a stiffness nor a curve; expected one"),
    "two laws": (
        lambda: TorsionSpring(
            name="s", joint="j", stiffness=1.0, curve=LoadCurve(deflections=(0.0, 1.0), loads=(0.0, 1.0))
        ),
        "both a stiffness and a curve; expected one",
    ),
    "stiffness 0": (
        lambda: TorsionSpring(name="s", joint="j", stiffness=0.0),
        "stiffness = 0.0: Expected a number",
    ),
    "lengths": (lambda: LoadCurve(deflections=(0.0, 1.0), loads=(0.0, 1.0, 2.0)), "2 deflections but 3 loads"),
    "falling": (
        lambda: LoadCurve(deflections=(0.0, 2.0, 1.0), loads=(0.0, 1.0, 2.0)),
        r"must rise; deflections\[1\] = 2, deflections\[2\] = 1",
    ),
    "twice": (
        lambda: LoadCurve(deflections=(0.0, 0.0), loads=(0.0, 1.0)),
        r"deflections\[0\] = 0, deflections\[1\] = 0",
    ),
    "a gap": (lambda: LoadCurve(deflections=(0.0, math.nan), loads=(0.0, 1.0)), "Expected a finite number"),
    "one point": (lambda: LoadCurve(deflections=(0.0,), loads=(0.0,)), "Expected at least 2 items, got 1"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_wrong_spring_is_refused(mistake):
    declare, message = MISTAKES[mistake]
    with pytest.raises(ModelError, match=message):
        declare()

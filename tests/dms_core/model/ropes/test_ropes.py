"""Rope forces, ropes of fixed length and their sensor against closed forms."""

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.constraints.rope_length import RopeLength, rope_length
from dms_core.model.geometry.path import PathPoint
from dms_core.model.ropes.rope_force import RopeForce, rope_force
from dms_core.model.sensors.rope import RopeSensor, rope_sensor
from tests.arm26 import body_coordinates
from tests.example_elements.pair import pair
from tests.example_elements.ropes import WINDING

STILL = [[0.0, 0.0, 0.0]]


def _state(system, placement, extra=()):
    q, _ = body_coordinates(system, placement.bodies)
    rng = np.random.default_rng(5)
    q = np.concatenate([q, extra])
    return q, rng.normal(size=q.size)


def _force(rope: RopeForce, system, u=STILL, extra=()):
    """Residual of the rope and its power on random velocities."""
    p = rope.place(system)
    q, v = _state(system, p, extra)
    n = p.size
    r, J = np.zeros(n), [np.zeros((n, n)) for _ in range(3)]
    ip, par = np.array(p.integers, np.int32), np.array(p.numbers)
    rope_force(ip, par, q, v, np.zeros(n), np.array(u), 0, r, *J)
    return r, v


def _sensed(sensor: RopeSensor, system, v, u=STILL, lam=(0.0,), extra=()):
    p = sensor.place(system)
    q, _ = _state(system, p, extra)
    m, n = len(sensor.outputs()), p.size
    y, Y = np.full(m, np.nan), [np.zeros((m, n)) for _ in range(3)]
    ip, par = np.array(p.integers, np.int32), np.array(p.numbers)
    rope_sensor(ip, par, q, v, v, np.array(lam), np.array(u), 0, y, *Y, np.zeros((m, 1)), np.zeros((m, 1)))
    return y


def test_power_is_tension_times_shortening():
    rope = RopeForce(name="rope", path=WINDING, tension=35.0)
    tape = RopeSensor(name="tape", rope="rope", components=("rate", "tension"))
    system = pair(forces=[rope], sensors=[tape])
    r, v = _force(rope, system)
    rate, tension = _sensed(tape, system, v)
    assert tension == 35.0
    # r = -f. Both sums have some fifty terms of size 100: rounding of 1e-12.
    assert r @ v == pytest.approx(35.0 * rate, rel=1e-12)


@pytest.mark.parametrize(("value", "tension"), [(80.0, 80.0), (0.0, 0.0), (-5.0, 0.0)])
def test_a_rope_does_not_push(value, tension):
    rope = RopeForce(name="rope", path=WINDING, input="pull")
    cell = RopeSensor(name="cell", rope="rope", components=("tension",))
    system = pair(forces=[rope], sensors=[cell], inputs=["pull"])
    r, v = _force(rope, system, [[value, 0.0, 0.0]])
    unit, _ = _force(RopeForce(name="rope", path=WINDING, tension=1.0), system)
    np.testing.assert_allclose(r, tension * unit, rtol=1e-14)
    assert _sensed(cell, system, v, [[value, 0.0, 0.0]]) == [tension]
    assert cell.outputs() == (("", "N"),)


def _constraint(rope: RopeLength, system, u):
    p = rope.place(system)
    q, v = _state(system, p)
    phi, phi_t = np.zeros(1), np.zeros((1, 2))
    G, W, H = np.zeros((1, p.size)), np.zeros((1, p.size)), np.zeros((p.size, p.size))
    ip, par = np.array(p.integers, np.int32), np.array(p.numbers)
    rope_length(ip, par, q, v, np.ones(1), np.array(u), 0, phi, phi_t, G, W, H)
    return phi[0], phi_t[0]


def test_the_length_is_that_of_the_start_or_the_given_one():
    free, fixed = RopeLength(name="rope", path=WINDING), RopeLength(name="rope", path=WINDING, length=2.0)
    tape = RopeSensor(name="tape", path=WINDING, components=("length",))
    system = pair(constraints=[free], sensors=[tape])
    length = _sensed(tape, system, np.zeros(21))[0]
    assert _constraint(free, system, STILL)[0] == pytest.approx(0.0, abs=1e-14)
    assert _constraint(fixed, system, STILL)[0] == pytest.approx(length - 2.0, abs=1e-14)


def test_the_length_is_an_input():
    rope = RopeLength(name="rope", path=WINDING, input="winch")
    tape = RopeSensor(name="tape", path=WINDING, components=("length",))
    system = pair(constraints=[rope], sensors=[tape], inputs=["winch"])
    length = _sensed(tape, system, np.zeros(21))[0]
    phi, phi_t = _constraint(rope, system, [[1.5, 0.2, -0.7]])
    assert phi == pytest.approx(length - 1.5, abs=1e-14)
    assert tuple(phi_t) == (-0.2, 0.7)


def test_the_multiplier_is_the_tension():
    rope = RopeLength(name="rope", path=WINDING)
    cell = RopeSensor(name="cell", rope="rope", components=("tension",))
    system = pair(constraints=[rope], sensors=[cell])
    assert cell.place(system).constraint == "rope"
    assert _sensed(cell, system, np.zeros(21), lam=(12.5,)) == [12.5]


ONE_BODY = (PathPoint(body="upper", point=(0.0, 0.0, 0.0)), PathPoint(body="upper", point=(1.0, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RopeForce(name="rope", path=WINDING), "rope_force 'rope'.*exactly one of tension, input, coordinate"),
        (lambda: RopeForce(name="rope", path=WINDING, tension=1.0, input="pull"), "exactly one"),
        (lambda: RopeForce(name="rope", path=WINDING, tension=-1.0), "tension = -1.0"),
        (lambda: RopeForce(name="rope", path=WINDING[:1], tension=1.0), "path"),
        (lambda: RopeForce(name="rope", path=ONE_BODY, tension=1.0).place(pair()), "'rope'.*never changes"),
        (lambda: RopeLength(name="rope", path=ONE_BODY).place(pair()), "'rope'.*never changes"),
        (lambda: RopeLength(name="rope", path=WINDING, length=1.0, input="winch"), "give one of them"),
        (lambda: RopeSensor(name="cell"), "either a rope or a path"),
        (lambda: RopeSensor(name="cell", path=WINDING, components=("tension",)), "a path has no tension"),
        (lambda: RopeSensor(name="cell", path=WINDING, components=("rate", "rate")), "named twice"),
        (lambda: RopeSensor(name="cell", rope="upper").place(pair()), "'upper' is a rigid_body"),
    ],
)
def test_mistakes_name_the_culprit(make, message):
    with pytest.raises(ModelError, match=message):
        make()

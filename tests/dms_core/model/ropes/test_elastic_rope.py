"""A rope that stretches, against closed forms: a spring while it is taut, nothing while it is slack."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import ElasticRope, Gravity, PathPoint, PointMass, RopeSensor, System
from dms_core.simulation.dynamics import SolverOptions, simulate

MASS, G, STIFFNESS, FREE = 2.0, 9.81, 4000.0, 0.8
STRETCH = MASS * G * FREE / STIFFNESS
"""At rest [m]."""
OMEGA = math.sqrt(STIFFNESS / (FREE * MASS))


def hanging(below: float, **numbers) -> Model:
    """A mass below a point, at that distance at the start."""
    mass = PointMass(name="mass", mass=MASS, position=(0.0, -below, 0.0))
    path = (PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="mass", point=(0.0, 0.0, 0.0)))
    rope = ElasticRope(name="rope", path=path, axial_stiffness=STIFFNESS, **{"free_length": FREE, **numbers})
    sensor = RopeSensor(name="cell", rope="rope", components=("length", "rate", "tension"))
    weight = Gravity(name="weight", acceleration=(0.0, -G, 0.0))
    return Model(System("hanging", bodies=[mass], forces=[rope, weight], sensors=[sensor]))


def test_taut_it_is_a_spring():
    """E A / x is its stiffness; the amplitude stays below the stretch at rest."""
    run = simulate(hanging(FREE + 0.5 * STRETCH), 1.0, SolverOptions(rtol=1e-8)).check()
    t = np.linspace(0.0, 1.0, 101)
    exact = FREE + STRETCH * (1.0 - 0.5 * np.cos(OMEGA * t))
    y = run.sensors(t)
    # A tolerance of 1e-8 of a metre a step, of which a few thousand add up.
    assert np.abs(y["cell.length"] - exact).max() < 2e-6
    assert y["cell.tension"] == pytest.approx(STIFFNESS * (exact - FREE) / FREE, abs=1e-2)


def test_taut_its_damper_is_linear():
    """C / x is the damper; the amplitude falls by exp(-delta t)."""
    damping = 0.1 * 2.0 * MASS * OMEGA * FREE
    delta = damping / (2.0 * FREE * MASS)
    ringing = math.sqrt(OMEGA**2 - delta**2)
    run = simulate(hanging(FREE + 0.8 * STRETCH, damping=damping), 1.0, SolverOptions(rtol=1e-8)).check()
    t = np.linspace(0.0, 1.0, 101)
    decay = np.exp(-delta * t) * (np.cos(ringing * t) + delta / ringing * np.sin(ringing * t))
    assert np.abs(run.sensors(t)["cell.length"] - FREE - STRETCH * (1.0 - 0.2 * decay)).max() < 2e-7


def test_a_falling_mass_is_caught_and_thrown_back():
    """Free fall by h, then E A s^2 / (2 x) = m g (h + s); without damping it comes back to where it fell from."""
    fall = 0.3
    s = STRETCH + math.sqrt(STRETCH**2 + 2.0 * STRETCH * fall)
    run = simulate(hanging(FREE - fall), 1.2, SolverOptions(rtol=1e-8)).check()
    t = np.linspace(0.0, 1.2, 24001)
    y = run.sensors(t)
    length, tension = y["cell.length"], y["cell.tension"]
    assert np.array_equal(tension > 0.0, length > FREE) and tension.min() == 0.0
    assert length.max() == pytest.approx(FREE + s, rel=1e-6)
    assert tension.max() == pytest.approx(STIFFNESS * s / FREE, rel=1e-5)
    touch = math.sqrt(2.0 * fall / G)
    # In the rope: a harmonic about the rest, from -stretch with the speed of the fall.
    turn = (math.pi - math.atan(math.sqrt(2.0 * G * fall) / (OMEGA * STRETCH))) / OMEGA
    assert t[np.argmax(length)] == pytest.approx(touch + turn, abs=1e-4)
    back = 2.0 * (touch + turn)
    k = int(np.argmin(np.abs(t - back)))
    assert length[k] == pytest.approx(FREE - fall, abs=1e-4)


@pytest.mark.parametrize("damping", [1.0, 30.0, 1e5])
def test_it_never_pushes_however_it_damps(damping):
    run = simulate(hanging(FREE - 0.4, damping=damping), 3.0, SolverOptions(rtol=1e-6)).check()
    y = run.sensors(run.t)
    assert y["cell.tension"].min() == 0.0 and y["cell.tension"].max() > MASS * G
    # Where the damper is limited to the elastic part, the tension is at most twice that.
    elastic = STIFFNESS * np.maximum(y["cell.length"] - FREE, 0.0) / FREE
    assert np.all(y["cell.tension"] <= 2.0 * elastic * (1.0 + 1e-12))
    energy = 0.5 * MASS * run.v[:, 1] ** 2 + MASS * G * run.q[:, 1]
    energy += 0.5 * STIFFNESS / FREE * np.maximum(y["cell.length"] - FREE, 0.0) ** 2
    assert np.all(np.diff(energy) < 1e-4)


def test_a_stiff_one_is_a_rope_of_fixed_length_that_goes_slack():
    """A pendulum on a rope released above its anchor falls freely until the rope is taut, and swings on its circle."""
    start = np.array([0.6, 0.45])
    mass = PointMass(name="mass", mass=MASS, position=(*start, 0.0))
    path = (PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="mass", point=(0.0, 0.0, 0.0)))
    rope = ElasticRope(name="rope", path=path, axial_stiffness=1e7, damping=2e4, free_length=0.75)
    weight = Gravity(name="weight", acceleration=(0.0, -G, 0.0))
    run = simulate(Model(System("swing", bodies=[mass], forces=[rope, weight])), 1.0, SolverOptions(rtol=1e-6)).check()
    taut = math.sqrt(2.0 * 2.0 * start[1] / G)
    t = np.linspace(0.0, 1.0, 1001)
    x = run.at(t).coordinate("mass.x")
    y = run.at(t).coordinate("mass.y")
    falling = t < taut - 1e-3
    assert x[falling] == pytest.approx(0.6, abs=1e-5)
    assert y[falling] == pytest.approx(start[1] - 0.5 * G * t[falling] ** 2, abs=1e-5)
    # The rope takes the speed along it away (its damper is strong), and the mass swings on with the rest.
    assert np.hypot(x, y)[t > taut + 0.05] == pytest.approx(0.75, abs=2e-5)
    k = int(np.argmin(np.abs(t - taut - 0.1)))
    at = run.at(t[k : k + 1])
    speed2 = float(at.rate("mass.x")[0] ** 2 + at.rate("mass.y")[0] ** 2)
    before = G * taut * 0.6 / 0.75
    assert speed2 == pytest.approx(before**2 + 2.0 * G * (-start[1] - y[k]), rel=2e-3)


@pytest.mark.parametrize(
    ("numbers", "complaint"),
    [
        ({"axial_stiffness": -1.0}, "axial_stiffness = -1.0: Expected a number above 0"),
        ({"damping": -1.0}, "damping = -1.0: Expected a number of at least 0"),
        ({"free_length": 0.0}, "free_length = 0.0: Expected a number above 0"),
        ({"path": (PathPoint(point=(0, 0, 0)),)}, "Expected at least 2 items, got 1"),
    ],
)
def test_a_wrong_rope_is_refused(numbers, complaint):
    path = (PathPoint(point=(0, 0, 0)), PathPoint(body="mass", point=(0, 0, 0)))
    with pytest.raises(ModelError, match=complaint):
        ElasticRope(**{"name": "rope", "path": path, "axial_stiffness": 1.0, **numbers})


def test_a_sensor_says_what_has_a_tension():
    with pytest.raises(ModelError, match="Expected a rope_force, elastic_rope, rope_length or drum_rope"):
        Model(
            System("x", bodies=[PointMass(name="m", mass=1.0)], forces=[Gravity(name="g")],
                   sensors=[RopeSensor(name="s", rope="g")])
        )  # fmt: skip

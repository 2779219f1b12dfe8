"""Loads of force elements on a body: derivatives, action and reaction, inputs."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.model import ForceLoad
from dms_core.simulation.dynamics import Simulation, World
from tests.dms_core.assembly.specimen import Point, random_point, scales, specimen
from tests.dms_core.test_derivatives import differences

LOADS = [
    ("cushion", "puck", "ground"), ("cushion", "puck", "puck"), ("spring", "upper", "plate"),
    ("spring", "plate", "ground"), ("biceps", "lower", "upper"), ("gravity", "lower", "lower"),
    ("pull", "plate", "ground"), ("push", "lower", "lower"), ("blow", "plate", "plate"), ("servo", "sleeve", "sleeve"),
    ("coil", "cog", "ground"), ("stop", "upper", "lower"),
]  # fmt: skip


def _sensors() -> list[ForceLoad]:
    return [
        ForceLoad(name=f"{f}.{b}.{x}", force=f, body=b, frame=x, point=(0.1, -0.2, 0.3) if x == "ground" else None)
        for f, b, x in LOADS
    ]


@pytest.fixture(scope="module")
def model():
    return specimen(*_sensors())


def _measured(model, signals, x: Point) -> np.ndarray:
    q, v, a, lam = (row[None] for row in x)
    return model.measure(signals, np.zeros(1), q, v, a, lam, np.zeros(1, bool))[0]


@pytest.mark.parametrize("seed", range(2))
def test_partials_are_differences_of_the_values(model, seed):
    signals, x, by = Simulation(model).state.signals, random_point(model, seed), scales(model)
    world = World(model)
    partials = world.sensor_blocks(world.operating_point()._replace(q=x.q, v=x.v, a=x.a, lam=x.lam))
    for name, scale in (("q", by[0]), ("v", by[1]), ("a", by[1])):
        f = lambda z, name=name: _measured(model, signals, x._replace(**{name: z}))  # noqa: E731
        numeric, analytic = differences(f, getattr(x, name), scale), getattr(partials, name)
        value = np.abs(f(getattr(x, name)))[:, None]
        # As in test_composite_sensors.py.
        allowed = 1e-6 * np.abs(numeric) + (1e-10 * value + 1e-8) / scale
        wrong = np.argwhere(np.abs(analytic - numeric) > allowed)
        assert not len(wrong), [(model.layout.outputs[i][0], j, analytic[i, j], numeric[i, j]) for i, j in wrong[:8]]
        assert name == "a" or np.any(numeric), f"no sensor depends on {name}: the test would pass with zeros"


def test_derivatives_by_the_inputs_of_the_element(model):
    x, signals = random_point(model, 1), Simulation(model).state.signals
    world, k = World(model), model.input_index("factor")
    partials = world.sensor_blocks(world.operating_point()._replace(q=x.q, v=x.v, a=x.a, lam=x.lam))
    before = _measured(model, signals, x)
    signals.c[signals.ptr[k], 0] += 1.0
    change = _measured(model, signals, x) - before
    moved = {
        name.rpartition(".")[0] for (name, _), d in zip(model.layout.outputs, change, strict=True) if abs(d) > 1e-6
    }
    assert moved >= {"blow.plate.plate", "pull.plate.ground", "servo.sleeve.sleeve"}
    # Linear in the factor, so that a difference over 1 is exact but for rounding of values near 1e3.
    np.testing.assert_allclose(partials.u[:, k, 0], change, atol=1e-9)


def test_a_spring_pulls_both_ends_equally():
    both = specimen(
        ForceLoad(name="i", force="spring", body="upper"), ForceLoad(name="j", force="spring", body="plate")
    )
    y = _measured(both, Simulation(both).state.signals, random_point(both, 0)).reshape(2, 6)
    assert np.abs(y[0, :3]).max() > 1.0
    np.testing.assert_allclose(y[0, :3], -y[1, :3], atol=1e-12)

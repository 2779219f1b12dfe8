"""A point mass is a rigid body that does not turn."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.bodies import PointMass
from dms_core.model.constraints import Distance
from dms_core.model.system import System
from tests.dms_core.model.poses import start
from tests.example_elements import Example
from tests.example_elements.kernel_call import kernel_calls

BALL = PointMass(name="ball", mass=3.0, position=(0.3, 0.4, 0.0), velocity=(1.0, 0.0, 0.0))


def test_inertia_is_mass_times_acceleration():
    call = kernel_calls(Example(System(bodies=[BALL]), BALL))[0]
    x = start(call)
    x.a[:3] = (1.0, -2.0, 0.5)
    np.testing.assert_array_equal(call(x)[0], [3.0, -6.0, 1.5, 0.0, 0.0, 0.0, 0.0])


def test_three_coordinates_and_no_unit_length_equation():
    assert [(c.name, c.start, c.rate) for c in BALL.coordinates()] == [
        ("x", 0.3, 1.0),
        ("y", 0.4, 0.0),
        ("z", 0.0, 0.0),
    ]
    assert System(bodies=[BALL]).constraints == ()


def test_rod_from_the_ground_takes_its_length_from_the_start():
    rod = Distance(name="rod", body_j="ball")
    call = kernel_calls(Example(System(bodies=[BALL], constraints=[rod]), rod))[0]
    phi, _, G, *_ = call(start(call))
    np.testing.assert_allclose(phi, 0.0, atol=1e-16)  # (0.25 - 0.5^2) / 1
    np.testing.assert_allclose(G[0, 7:10], [0.6, 0.8, 0.0], rtol=1e-15)


def test_mass_must_be_positive():
    with pytest.raises(ModelError, match=r"point_mass 'ball': mass = 0.0: Expected a number above 0"):
        PointMass(name="ball", mass=0.0)

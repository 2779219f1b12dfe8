"""Derivatives by declared numbers in the world of a patient, whose numbers were written over those of the template."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model, World
from dms_core.errors import InputError
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.world.kernels.scaling import declared

NUMBERS = [
    ("TRIlat", "pennation_angle"),
    ("BRA", "max_contraction_velocity"),
    ("BRA", "max_isometric_force"),
    ("forearm", "centre_of_mass.1"),
]
"""Numbers, of which the first two enter the tables otherwise than linearly."""


@pytest.fixture(scope="module")
def env() -> ElbowLiftEnv:
    env = ElbowLiftEnv(patient={"body_mass": 100.0, "height": 2.0, "strength": 1.5}, load=1.0, noise=False)
    env.reset(seed=3)
    for _ in range(3):
        env.step(np.array([-0.3, -0.8]))
    return env


@pytest.mark.parametrize(("name", "number"), NUMBERS)
def test_derivatives_are_those_of_a_model_of_the_patient(env, name, number):
    world, drive, ecosystem = env.episode.world, env.episode.drive, env.episode.ecosystem
    at = world.operating_point()
    system = declared(ecosystem, drive, 1.0, drive.start(ecosystem.device, 0.0))
    right = World(Model(system, like=world.model), env.world.options).parameter_blocks(name, number, at)
    with pytest.raises(InputError, match=f"'{name}': '{number}' moves numbers of .* written in place: .*system="):
        world.parameter_blocks(name, number, at)
    found = world.parameter_blocks(name, number, at, system)
    for what in ("r1", "r2", "r3", "r4", "y"):
        one, other = getattr(found, what), getattr(right, what)
        # The patient's numbers agree with the declared ones to 1e-9, and differences amplify rounding by 1 / STEP.
        np.testing.assert_allclose(one, other, atol=1e-6 * (1.0 + np.abs(other).max()), err_msg=what)
    assert np.any(found.r2)

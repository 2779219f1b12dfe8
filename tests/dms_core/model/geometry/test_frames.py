"""Euler parameters of rotation matrices: those that the matrix was made of, whatever the angle."""

import numpy as np
import pytest

from dms_core.model.geometry.frames import euler_parameters, quaternion, rotation_matrix

AXES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 2, -3), (-1, 1e-9, 0)]


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("angle", [0.0, 1e-8, 1.0, 2.5, np.pi - 1e-8, np.pi, 4.0])
def test_back_to_the_euler_parameters(axis, angle):
    given = quaternion(axis, angle)
    found = euler_parameters(rotation_matrix(given))
    # p and -p are the same rotation.
    np.testing.assert_allclose(found * np.sign(found @ given), given, atol=1e-15)

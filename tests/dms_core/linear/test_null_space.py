"""Independent coordinates: orthonormal, of the right number, blind to redundant rows."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.linear.null_space import null_space
from dms_core.simulation.dynamics import World
from tests.dms_core.assembly.test_newton_matrix import _square


@pytest.mark.parametrize("seed", range(4))
def test_null_space_of_matrices_with_redundant_rows_of_any_size(seed):
    rng = np.random.default_rng(seed)
    rank, n = (3, 5, 1, 7)[seed], 9
    G = rng.normal(size=(12, rank)) @ rng.normal(size=(rank, n)) * 10.0 ** rng.uniform(-3, 3, (12, 1))
    N = null_space(G)
    assert N.shape == (n, n - rank)
    # Orthogonal to rounding, row by row.
    assert np.abs(G @ N).max() < 1e-12 * np.abs(G).max()
    np.testing.assert_allclose(N.T @ N, np.eye(n - rank), atol=1e-14)


def test_no_constraint_leaves_every_coordinate():
    np.testing.assert_array_equal(null_space(np.zeros((0, 3))), np.eye(3))
    np.testing.assert_array_equal(null_space(np.zeros((2, 3))), np.eye(3))


def test_a_loop_with_redundant_rows_has_one_freedom_along_the_motion():
    world = World(_square())
    for t in (0.0, 0.2, 0.5):
        world.advance(t)
        N = world.null_space()
        assert N.shape == (21, world.model.degrees_of_freedom) == (21, 1)
        v = world.state.v
        # The mechanism moves along its only direction; phi_q v = 0 is closed to 1e-10.
        assert np.abs(v - N @ (N.T @ v)).max() < 1e-9

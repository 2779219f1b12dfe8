"""Rank, independent rows and minimum-norm multipliers on matrices whose answer is known."""

import numpy as np
import pytest

from dms_core.errors import InputError
from dms_core.linear.rank import independent_rows, minimum_norms
from tests.dms_core.linear.exact_norm import exact_norm


def known_rank(m, n, rank, seed=0):
    """Random m x n matrix of the given rank."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal((m, rank)) @ rng.standard_normal((rank, n))


@pytest.mark.parametrize(("m", "n", "rank"), [(15, 49, 11), (12, 49, 11), (47, 49, 47), (6, 4, 4), (5, 5, 1)])
def test_rank_and_independent_set(m, n, rank):
    G = known_rank(m, n, rank)
    found = independent_rows(G)
    assert found.independent.size == rank and found.redundant.size == m - rank
    assert np.array_equal(np.sort(np.concatenate([found.independent, found.redundant])), np.arange(m))
    assert np.linalg.matrix_rank(G[found.independent]) == rank
    # A least-squares fit of condition up to 1e3: 1e-16 * 1e3, with room.
    assert np.allclose(found.combination @ G[found.independent], G[found.redundant], rtol=0.0, atol=1e-10)


def test_later_rows_are_called_redundant():
    G = np.vstack([np.eye(3, 5), 7.0 * np.eye(3, 5)[1], np.zeros(5), np.eye(5)[4]])
    found = independent_rows(G)
    assert list(found.independent) == [0, 1, 2, 5] and list(found.redundant) == [3, 4]
    # Row 3 is seven times row 1, row 4 is nothing: exact up to the rounding of a 4 x 5 least-squares problem.
    assert np.allclose(found.combination, [[0.0, 7.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]], rtol=0.0, atol=1e-14)
    assert np.allclose(found.singular_values, [np.sqrt(2.0), 1.0, 1.0, 1.0, 0.0], rtol=0.0, atol=1e-14)


def test_units_of_rows_do_not_change_the_answer():
    G = known_rank(8, 10, 8)
    scaled = G * 10.0 ** np.array([-6, 6, 0, 3, -3, 1, 5, -5])[:, None]
    assert independent_rows(scaled).redundant.size == 0


def test_tolerance_decides():
    G = np.array([[1.0, 0.0], [1.0, 1e-6]])
    assert independent_rows(G).redundant.size == 0
    assert list(independent_rows(G, tol=1e-5).redundant) == [1]


def test_nothing_to_do():
    assert independent_rows(np.zeros((0, 4))).independent.size == 0
    assert list(independent_rows(np.zeros((2, 4))).redundant) == [0, 1]
    with pytest.raises(InputError, match="1 are not"):
        independent_rows(np.array([[np.nan, 1.0]]))


def test_two_equal_supports_share_the_load():
    """A load of 10 N on two identical rows: 5 N each, whatever the multipliers were."""
    G = np.array([[[1.0, 0.0], [1.0, 0.0]]])
    # Four passes of refinement leave less than 1e-12 of what the regularisation spoils.
    assert np.allclose(minimum_norms(G, np.array([[13.0, -3.0]])), [[5.0, 5.0]], rtol=0.0, atol=1e-11)


def test_minimum_norm_keeps_the_force_and_is_shortest():
    G, rng = np.stack([known_rank(15, 49, 11, seed) for seed in range(3)]), np.random.default_rng(4)
    lam = rng.standard_normal((3, 15))
    best = minimum_norms(G, lam)
    for k in range(3):
        # Products of 15 terms of size up to 10, and what four passes of refinement leave.
        assert np.allclose(G[k].T @ best[k], G[k].T @ lam[k], rtol=0.0, atol=1e-10)
        assert np.allclose(best[k], exact_norm(G[k], lam[k]), rtol=0.0, atol=1e-11)
        assert np.allclose(best[k], np.linalg.lstsq(G[k].T, G[k].T @ lam[k], rcond=1e-9)[0], rtol=0.0, atol=1e-11)
        assert np.linalg.norm(best[k]) < 0.99 * np.linalg.norm(lam[k])


def test_full_rank_leaves_multipliers_alone():
    lam = np.arange(4.0)[None]
    assert np.allclose(minimum_norms(known_rank(4, 9, 4)[None], lam), lam, rtol=0.0, atol=1e-11)

"""Rank, least norm and smallest singular value of sparse matrices, against dense ones."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from dms_core.linear.rank import degenerate_rows, independent_rows, least_norm, multipliers_of
from dms_core.linear.sparse_rank import Normal


def _banded(rng: np.random.Generator, redundant: int) -> np.ndarray:
    """40 independent rows of five neighbouring entries in 60 columns, and sums of some of them, in any order."""
    G = np.zeros((40, 60))
    for k in range(40):
        G[k, k : k + 5] = rng.normal(size=5)
    sums = np.array([G[k : k + 3].sum(axis=0) for k in rng.choice(37, redundant, replace=False)]).reshape(-1, 60)
    return np.concatenate([G, sums])[rng.permutation(40 + redundant)]


@pytest.mark.parametrize("redundant", [0, 1, 7])
def test_rank_is_that_of_the_dense_matrix(redundant):
    for seed in range(5):
        G = _banded(np.random.default_rng(seed), redundant)
        dense, sparse = independent_rows(G), independent_rows(sp.csr_array(G))
        assert len(sparse.independent) == len(dense.independent) == 40
        assert np.linalg.matrix_rank(G[sparse.independent]) == 40
        assert np.array_equal(np.sort([*sparse.independent, *sparse.redundant]), np.arange(40 + redundant))


def test_an_almost_redundant_row_counts_by_the_tolerance():
    G = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1e-6]])
    assert len(independent_rows(sp.csr_array(G), 1e-9).independent) == 3
    assert len(independent_rows(sp.csr_array(G), 1e-5).independent) == 2


def test_least_norm_is_that_of_least_squares():
    rng = np.random.default_rng(1)
    G = _banded(rng, 5)
    b = G @ rng.normal(size=60)
    np.testing.assert_allclose(least_norm(sp.csr_array(G), b), least_norm(G, b), atol=1e-9)


def test_multipliers_give_back_their_force():
    rng = np.random.default_rng(2)
    G = _banded(rng, 0)
    forces = rng.normal(size=(3, 40)) @ G
    for matrix in (G, sp.csr_array(G)):
        np.testing.assert_allclose(multipliers_of(matrix, forces) @ G, forces, atol=1e-9)


def test_extreme_singular_values():
    """About: power methods of a dozen steps."""
    G = _banded(np.random.default_rng(3), 0)
    values = np.linalg.svd(G / np.linalg.norm(G, axis=1)[:, None], compute_uv=False)
    largest, smallest, _ = Normal(sp.csr_array(G)).extremes()
    assert largest == pytest.approx(values[0], rel=0.1)
    assert smallest == pytest.approx(values[-1], rel=0.1)


@pytest.mark.parametrize("form", [np.asarray, sp.csr_array])
def test_rows_that_lose_rank_together_are_found(form):
    """Rows 1 and 3 are nearly parallel."""
    G = np.eye(5)[:4] + 0.0
    G[3] = G[1] + [0.0, 0.0, 0.0, 1e-4, 0.0]
    smallest, part = degenerate_rows(form(G), 4)
    assert smallest < 1e-4
    assert set(np.argsort(part)[-2:]) == {1, 3}

"""Order of elimination: valid, repeatable, safe, cheap on chains; singular matrices are named."""

import numpy as np
import pytest

from dms_core.errors import InputError
from dms_core.linear.ordering import SingularMatrixError, markowitz
from dms_core.linear.symbolic import plan
from tests.dms_core.linear.chain_matrix import chain_newton_matrix


def triplets(dense):
    """Entries of a dense matrix."""
    rows, cols = np.nonzero(dense)
    return rows, cols, dense[rows, cols]


def smallest_pivot_in_row(dense, row_perm, col_perm):
    """Eliminates densely in the given order; the smallest |pivot| / largest entry of its row, as ordered."""
    B = dense[np.ix_(row_perm, col_perm)].astype(float)
    worst = np.inf
    for k in range(len(B)):
        worst = min(worst, abs(B[k, k]) / abs(B[k, k:]).max())
        B[k + 1 :, k:] -= np.outer(B[k + 1 :, k] / B[k, k], B[k, k:])
    return worst


@pytest.mark.parametrize("strategy", [{}, {"window": 20, "free_cost": 60}, {"window": 3}, {"seed": 7}])
def test_permutations_and_threshold(strategy):
    A = chain_newton_matrix(3)
    n = A.shape[0]
    rp, cp = markowitz(n, A.row, A.col, A.data, threshold=0.1, **strategy)
    assert np.array_equal(np.sort(rp), np.arange(n)) and np.array_equal(np.sort(cp), np.arange(n))
    # The threshold holds for the scaled matrix; columns of this one differ by up to about 1e3 before scaling.
    assert smallest_pivot_in_row(A.toarray(), rp, cp) > 0.1 * 1e-3


def test_threshold_holds_exactly_where_scaling_does_nothing():
    rng = np.random.default_rng(1)
    dense = np.sign(rng.standard_normal((30, 30))) * (rng.random((30, 30)) < 0.2) + 0.0
    dense[np.arange(30), rng.permutation(30)] = 1.0
    assert np.linalg.matrix_rank(dense) == 30  # all entries are 0, 1 or -1: nothing to scale
    order = markowitz(30, *triplets(dense), threshold=0.5)
    assert smallest_pivot_in_row(dense, *order) >= 0.5 * (1.0 - 1e-12)  # 1e-12: another order of summation


def test_same_seed_same_order_other_seed_other_order():
    A = chain_newton_matrix(4)
    orders = [markowitz(A.shape[0], A.row, A.col, A.data, seed=s) for s in (3, 3, 4)]
    assert np.array_equal(orders[0], orders[1])
    assert not np.array_equal(orders[0], orders[2])


def test_arrow_matrix_has_no_fill():
    """Dense first row and column: the natural order fills everything, Markowitz' nothing."""
    n = 50
    dense = np.diag(np.full(n, 4.0))
    dense[0, :] = dense[:, 0] = 1.0
    tables = plan(n, *triplets(dense))
    assert tables.fill == 3 * n - 2
    assert tables.multiply_adds == 2 * (n - 1)


def test_cost_of_a_chain_grows_in_proportion():
    per_link = []
    for links in (32, 64):
        A = chain_newton_matrix(links)
        per_link.append(plan(A.shape[0], A.row, A.col, A.data).updates / links)
    # Twice the chain costs twice; the ends of a chain are cheaper, which is about 10 % at 32 links.
    assert per_link[1] < 1.15 * per_link[0]


def test_structurally_singular_is_named():
    dense = np.diag(np.arange(1.0, 7.0))
    dense[4, 4], dense[4, 1] = 0.0, 1.0  # rows 1 and 4 live in column 1 alone, column 4 is empty
    with pytest.raises(SingularMatrixError, match="singular") as caught:
        markowitz(6, *triplets(dense))
    assert list(caught.value.columns) == [4]
    assert caught.value.rows[0] in (1, 4) and caught.value.rows.size == 1


def test_numerically_singular_is_named():
    A = chain_newton_matrix(3)
    n = A.shape[0]
    dense = A.toarray()
    twin, original = n - 1, n - 2
    dense[twin] = 2.0 * dense[original]
    with pytest.raises(SingularMatrixError) as caught:
        markowitz(n, *triplets(dense))
    assert caught.value.rows.size == caught.value.columns.size == 1
    # One row of the dependent pair is left over: it is a combination of all others and so named.
    assert caught.value.rows[0] in (twin, original)


def test_mistakes_of_the_caller():
    rows, cols = np.array([0, 1]), np.array([0, 1])
    with pytest.raises(InputError, match="row 1, column 1 is nan"):
        markowitz(2, rows, cols, np.array([1.0, np.nan]))
    with pytest.raises(InputError, match="indices 0 to 1 do not fit a matrix of size 1"):
        markowitz(1, rows, cols, np.ones(2))
    with pytest.raises(InputError, match="threshold = 0.0"):
        markowitz(2, rows, cols, np.ones(2), threshold=0.0)
    with pytest.raises(InputError, match="shapes"):
        markowitz(2, rows, cols, np.ones(3))

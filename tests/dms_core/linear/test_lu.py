"""Compiled LU: against LAPACK and SuperLU, transposed, repeatable to the bit, without allocation."""

import numpy as np
import pytest
import scipy.sparse as sp
from numba import njit
from numba.core.runtime import _nrt_python, rtsys
from scipy.sparse.linalg import splu

from dms_core.errors import InputError
from dms_core.linear.lu import assemble, factor, solve, solve_transposed, storage
from dms_core.linear.ordering import SingularMatrixError, markowitz
from dms_core.linear.symbolic import plan, symbolic
from tests.dms_core.linear.chain_matrix import chain_newton_matrix


def solved(tables, values, b, transposed=False):
    """x, and what factor returned."""
    a, work, x = storage(tables.size), storage(tables.work_size), np.zeros(tables.n)
    assemble(tables, values, a)
    quality = factor(tables, a, work)
    (solve_transposed if transposed else solve)(tables, a, b, x, work)
    return x, quality


def backward_error(A, x, b):
    """Relative change of the entries that would explain x: |b - A x| / (|A| |x| + |b|) (Oettli and Prager 1964)."""
    return np.max(np.abs(b - A @ x) / (np.abs(A) @ np.abs(x) + np.abs(b)))


def random_matrix(n, density, seed, spread=0.0):
    """Random unsymmetric pattern with a random full transversal, rows and columns scaled by 10^(+-spread)."""
    rng = np.random.default_rng(seed)
    dense = rng.standard_normal((n, n)) * (rng.random((n, n)) < density)
    dense[np.arange(n), rng.permutation(n)] = 2.0 + rng.random(n)
    scale = 10.0 ** rng.uniform(-spread, spread, (2, n))
    return sp.coo_matrix(scale[0][:, None] * dense * scale[1])


@pytest.mark.parametrize("links", [1, 2, 8, 40])
@pytest.mark.parametrize("transposed", [False, True])
def test_newton_matrix_against_superlu(links, transposed):
    A = chain_newton_matrix(links)
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    x, (ratio, _) = solved(plan(A.shape[0], A.row, A.col, A.data), A.data, b, transposed)
    reference = splu(sp.csc_matrix(A)).solve(b, "T" if transposed else "N")
    # Condition 1e3 and a growth of entries below 1e3 (pivots of 10 % of their row) leave ten of sixteen digits.
    assert np.abs(x - reference).max() <= 1e-10 * np.abs(reference).max()
    assert 1e-3 < ratio


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("transposed", [False, True])
def test_random_patterns_against_lapack(seed, transposed):
    n = (1, 2, 7, 8, 9, 20, 33, 64, 65, 100, 150, 200)[seed]
    A = random_matrix(n, min(1.0, 3.0 / n), seed)
    dense = A.toarray().T if transposed else A.toarray()
    b = np.random.default_rng(seed).standard_normal(n)
    x, _ = solved(plan(n, A.row, A.col, A.data), A.data, b, transposed)
    # Forward error: condition number times rounding times a growth of up to 1e3.
    reference = np.linalg.solve(dense, b)
    limit = 1e3 * np.finfo(float).eps * np.linalg.cond(dense)
    assert np.linalg.norm(x - reference) <= limit * np.linalg.norm(reference)


def test_bad_units_do_not_spoil_it():
    """Rows and columns in units that differ by up to 1e6: the order is chosen on scaled values, LAPACK's is not."""
    ours, lapack = [], []
    for seed in range(10):
        A = random_matrix(80, 0.05, seed, spread=3.0)
        b = A @ np.ones(80)
        ours.append(backward_error(A, solved(plan(80, A.row, A.col, A.data), A.data, b)[0], b))
        lapack.append(backward_error(A, np.linalg.solve(A.toarray(), b), b))
    # Measured over 30 seeds: at most 1.3e-12 (rounding times the growth that pivots of 10 % allow), LAPACK 5e-10.
    assert max(ours) < 1e-11
    assert max(ours) < max(lapack)


def test_new_values_in_the_same_pattern():
    first, other = chain_newton_matrix(6, seed=0), chain_newton_matrix(6, h=3e-3, seed=5)
    assert np.array_equal(first.row, other.row) and np.array_equal(first.col, other.col)
    tables = plan(first.shape[0], first.row, first.col, first.data)
    b = np.ones(tables.n)
    x, _ = solved(tables, other.data, b)
    reference = splu(sp.csc_matrix(other)).solve(b)
    # As above; the pivots were chosen for the other values, which costs up to two digits more.
    assert np.abs(x - reference).max() <= 1e-8 * np.abs(reference).max()


def test_repeated_entries_add_up_and_the_waste_bin_is_outside():
    rows, cols, values = np.array([0, 1, 1, 0]), np.array([0, 1, 0, 0]), np.array([1.0, 2.0, 4.0, 1.0])
    tables = plan(2, rows, cols, values)
    x, _ = solved(tables, values, np.array([2.0, 8.0]))
    assert np.array_equal(x, [1.0, 2.0])  # [[2, 0], [4, 2]] x = (2, 8): exact in binary
    assert tables.position.dtype == np.int32 and tables.position[0] == tables.position[3]
    assert tables.position.max() < tables.size - 8
    a, work, y = storage(tables.size), storage(tables.work_size), np.zeros(2)
    assemble(tables, values, a)
    a[tables.size - 1] = np.nan  # dropped numbers must not reach the result
    factor(tables, a, work)
    solve(tables, a, np.array([2.0, 8.0]), y, work)
    assert np.array_equal(x, y)


def test_given_order_keeps_fill_and_result():
    A = chain_newton_matrix(4)
    n, b = A.shape[0], np.arange(1.0, A.shape[0] + 1)
    rp, cp = markowitz(n, A.row, A.col, A.data)
    tables = symbolic(n, A.row, A.col, rp, cp)
    pattern = np.zeros((n, n), bool)
    pattern[A.row, A.col] = True
    pattern, adds = pattern[np.ix_(rp, cp)], 0
    for k in range(n):
        below, right = np.flatnonzero(pattern[k + 1 :, k]) + k + 1, np.flatnonzero(pattern[k, k + 1 :]) + k + 1
        pattern[np.ix_(below, right)] = True
        adds += below.size * (1 + right.size)
    # Exchanged steps have the same fill and the same multiply-adds as the order that was given.
    assert tables.fill == pattern.sum() and tables.multiply_adds == adds
    x, _ = solved(tables, A.data, b)
    assert backward_error(A, x, b) < 1e-11  # as in test_bad_units_do_not_spoil_it


def test_same_bits_twice():
    A = chain_newton_matrix(8)
    tables, b = plan(A.shape[0], A.row, A.col, A.data), np.linspace(-1.0, 1.0, A.shape[0])
    again = plan(A.shape[0], A.row, A.col, A.data)
    assert all(np.array_equal(s, t) for s, t in zip(tables, again, strict=True))
    first, second = solved(tables, A.data, b), solved(tables, A.data, b)
    assert first[0].tobytes() == second[0].tobytes() and first[1] == second[1]
    # Neither leftovers in the work array nor the alignment of the storage change a bit.
    a, work, x = np.zeros(tables.size + 1)[1:], np.full(tables.work_size, np.nan), b.copy()
    assemble(tables, A.data, a)
    factor(tables, a, work)
    solve(tables, a, x, x, work)
    assert x.tobytes() == first[0].tobytes()


@njit
def _many(tables, values, a, b, x, work, count):
    """Everything that a Newton iteration calls, from compiled code."""
    for _ in range(count):
        assemble(tables, values, a)
        factor(tables, a, work)
        solve(tables, a, b, x, work)
        solve_transposed(tables, a, b, x, work)


@njit
def _allocates(count):
    """What the counter must see."""
    total = 0.0
    for k in range(count):
        total += np.zeros(k + 10).sum()
    return total


def test_nothing_is_allocated():
    """More repetitions, no more allocations: what is left is the cost of the call from Python."""
    A = chain_newton_matrix(2)
    tables = plan(A.shape[0], A.row, A.col, A.data)
    arrays = (storage(tables.size), np.ones(tables.n), np.zeros(tables.n), storage(tables.work_size))

    def allocations(function, *arguments):
        function(*arguments, 1)
        before = rtsys.get_allocation_stats().alloc
        function(*arguments, 1)
        middle = rtsys.get_allocation_stats().alloc
        function(*arguments, 51)
        return rtsys.get_allocation_stats().alloc - middle - (middle - before)

    _nrt_python.memsys_enable_stats()  # numba counts allocations only when asked
    try:
        assert allocations(_allocates) >= 50
        assert allocations(_many, tables, A.data, *arrays) == 0
    finally:
        _nrt_python.memsys_disable_stats()


def test_zero_pivot_is_reported_with_its_step():
    A = chain_newton_matrix(2)
    tables = plan(A.shape[0], A.row, A.col, A.data)
    a, work = storage(tables.size), storage(tables.work_size)
    for step in (0, 17, tables.n - 1):
        row, col = tables.row_of[step], tables.col_of[step]
        values = np.where((A.row == row) | (A.col == col), 0.0, A.data)  # nothing in its row and column
        assemble(tables, values, a)
        assert factor(tables, a, work) == (0.0, step)
        values[(A.row == row) & (A.col == A.col[A.row == row][0])] = np.nan
        assemble(tables, values, a)
        assert factor(tables, a, work)[0] == 0.0


def test_lost_digits_show_in_the_ratio():
    """[[1, 1], [1, 1 + e]]: the second pivot is e, of a row of 2 + e."""
    e = 2.0**-30
    rows, cols = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    tables = symbolic(2, rows, cols, np.array([0, 1]), np.array([0, 1]))
    _, (ratio, step) = solved(tables, np.array([1.0, 1.0, 1.0, 1.0 + e]), np.ones(2))
    assert step == 1 and ratio == e / (2.0 + e)


def test_orders_that_cannot_be():
    rows = cols = np.array([0, 1])
    with pytest.raises(InputError, match="row_perm is no permutation of 0 to 1"):
        symbolic(2, rows, cols, np.array([0, 0]), np.array([0, 1]))
    with pytest.raises(SingularMatrixError) as caught:
        symbolic(2, rows, cols, np.array([1, 0]), np.array([0, 1]))
    assert (caught.value.rows[0], caught.value.columns[0]) == (1, 0)


def test_storage_starts_at_cache_lines():
    for worlds in (None, 1, 5):
        x = storage(13, worlds)
        assert x.shape == ((13,) if worlds is None else (worlds, 13)) and not x.any()
        for row in np.atleast_2d(x):
            assert row.ctypes.data % 64 == 0


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_complex_matrices_in_the_same_tables(seed, transposed):
    """The same kernels on complex arrays, against LAPACK; and a real matrix gives the real solution."""
    n = (7, 20, 65, 150)[seed]
    A = random_matrix(n, min(1.0, 3.0 / n), seed)
    tables, rng = plan(n, A.row, A.col, A.data), np.random.default_rng(seed)
    values = A.data * (1.0 + 0.7j * rng.standard_normal(len(A.data)))
    dense = sp.coo_matrix((values, (A.row, A.col)), A.shape).toarray()
    b = rng.standard_normal(n) + 1j * rng.standard_normal(n)
    a, work = storage(2 * tables.size).view(complex), storage(2 * tables.work_size).view(complex)
    x, real = np.zeros(n, complex), solved(tables, A.data, b.real.copy(), transposed)[0]
    assemble(tables, values, a)
    assert factor(tables, a, work)[0] > 0.0
    (solve_transposed if transposed else solve)(tables, a, b, x, work)
    reference = np.linalg.solve(dense.T if transposed else dense, b)
    limit = 1e3 * np.finfo(float).eps * np.linalg.cond(dense)
    assert np.linalg.norm(x - reference) <= limit * np.linalg.norm(reference)
    assemble(tables, A.data.astype(complex), a)
    factor(tables, a, work)
    (solve_transposed if transposed else solve)(tables, a, b.real.astype(complex), x, work)
    np.testing.assert_allclose(x.real, real, rtol=1e-9, atol=1e-12 * np.abs(real).max())
    assert np.abs(x.imag).max() <= 1e-12 * np.abs(real).max()


@pytest.mark.parametrize("density", [0.02, 0.9])
@pytest.mark.parametrize("kind", [float, complex])
def test_both_ways_to_solve(density, kind):
    """Sparse blocks are solved entry by entry, dense ones block by block; the factors behind them are the same."""
    n = 60
    A = random_matrix(n, density, seed=3)
    tables, b = plan(n, A.row, A.col, A.data), np.linspace(1.0, 2.0, n).astype(kind)
    values = A.data * (1.0 + (0.5j if kind is complex else 0.0))
    assert (tables.move.size > 0) == (density < 0.1)
    a, work = (np.zeros(k, kind) for k in (tables.size, tables.work_size))
    assemble(tables, values, a)
    factor(tables, a, work)
    solve(tables, a, b, b, work)  # in place
    dense = sp.coo_matrix((values, (A.row, A.col))).toarray()
    limit = 1e3 * np.finfo(float).eps * np.linalg.cond(dense)  # as in test_random_patterns_against_lapack
    assert np.linalg.norm(b - np.linalg.solve(dense, np.linspace(1.0, 2.0, n))) <= limit * np.linalg.norm(b)


def test_a_move_waits_for_what_it_reads():
    """Each move of L comes behind all that change what it reads, each of U too; each entry stands there once."""
    A = random_matrix(80, 0.03, seed=1)
    tables = plan(80, A.row, A.col, A.data)
    goal, source = tables.move >> 32, tables.move & (2**32 - 1)
    assert tables.move.size == tables.fill - tables.n == np.unique(tables.place).size
    for half, below in ((slice(0, tables.lower), True), (slice(tables.lower, None), False)):
        assert ((goal[half] > source[half]) == below).all()
        last = {int(g): k for k, g in enumerate(goal[half])}
        assert all(last.get(int(s), -1) < k for k, s in enumerate(source[half]))

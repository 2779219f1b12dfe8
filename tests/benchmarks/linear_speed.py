"""Speed of the compiled LU on Newton matrices of hinged chains, beside SuperLU and dense LAPACK in the same run.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/linear_speed.py [links ...]

Medians of repetitions, caches warm. The first factorisation after other work takes somewhat longer.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numba import njit
from scipy.sparse.linalg import splu

from dms_core.linear.lu import assemble, factor, solve, solve_transposed, storage
from dms_core.linear.symbolic import plan
from tests.dms_core.linear.chain_matrix import chain_newton_matrix


@njit(cache=True)
def _assemblies(count, tables, values, a):
    for _ in range(count):
        assemble(tables, values, a)


@njit(cache=True)
def _copies(count, a, matrix):
    for _ in range(count):
        a[:] = matrix


@njit(cache=True)
def _factorisations(count, tables, a, matrix, work):
    for _ in range(count):
        a[:] = matrix
        factor(tables, a, work)


@njit(cache=True)
def _solves(count, tables, a, b, x, work):
    for _ in range(count):
        solve(tables, a, b, x, work)


@njit(cache=True)
def _transposed(count, tables, a, b, x, work):
    for _ in range(count):
        solve_transposed(tables, a, b, x, work)


def median(function: Callable, *arguments, count: int = 0, repeats: int = 9) -> float:
    """Microseconds of one call; with a count, of one of that many repetitions inside compiled code."""
    arguments = (count, *arguments) if count else arguments
    function(*arguments)
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function(*arguments)
        times.append(time.perf_counter() - start)
    return 1e6 * float(np.median(times)) / (count or 1)


def report(links: int) -> str:
    """One line of the table."""
    A = chain_newton_matrix(links)
    n, count = A.shape[0], max(1, 20_000 // links**2)
    start = time.perf_counter()
    tables = plan(n, A.row, A.col, A.data)
    planned = time.perf_counter() - start
    a, matrix, work = storage(tables.size), storage(tables.size), storage(tables.work_size)
    b, x = np.ones(n), np.zeros(n)
    assemble(tables, A.data, matrix)
    a[:] = matrix
    factor(tables, a, work)
    ours = [
        median(_assemblies, tables, A.data, matrix, count=count),
        median(_factorisations, tables, a, matrix, work, count=count) - median(_copies, a, matrix, count=count),
        median(_solves, tables, a, b, x, work, count=count),
        median(_transposed, tables, a, b, x, work, count=count),
    ]
    sparse = sp.csc_matrix(A)
    superlu = splu(sparse)
    others = [median(splu, sparse, repeats=5), median(superlu.solve, b)]
    if n < 3000:
        dense = sparse.toarray()
        factors = la.lu_factor(dense)
        others += [median(la.lu_factor, dense, repeats=3), median(la.lu_solve, factors, b)]
    counts = (
        f"{links:5d} {n:6d} {A.nnz:7d} {tables.fill:7d} {tables.multiply_adds:8d} {tables.updates:8d} {planned:7.3f}"
    )
    return counts + " " + " ".join(f"{x:9.2f}" for x in ours + others)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "links", nargs="*", type=int, default=(1, 2, 4, 8, 16, 32, 64, 128, 256), help="links of a chain"
    )
    lengths = parser.parse_args().links
    print("links      n     nnz    fill  mult-add  updates  plan/s  assemble    factor     solve  solve^T"
          "   SuperLU     solve    LAPACK     solve   [us]")  # fmt: skip
    report(1)
    for links in lengths:
        print(report(links), flush=True)

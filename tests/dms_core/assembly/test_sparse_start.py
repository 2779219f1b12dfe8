"""A start assembled with a sparse phi_q is that of the dense one."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model
from dms_core.assembly import model as model_module
from dms_core.simulation.dynamics import Simulation
from tests.benchmarks.problems import chain
from tests.dms_core.assembly.specimen import specimen
from tests.dms_core.cases import model


def test_the_sparse_jacobian_is_the_dense_one(monkeypatch):
    made = specimen()
    q, v = made.start.q, made.start.v
    dense = made.jacobian(q, v, 0.1)
    monkeypatch.setattr(model_module, "SPARSE_ROWS", 0)
    sparse = made.jacobian(q, v, 0.1)
    for k in range(2):
        np.testing.assert_array_equal(dense[k], sparse[k])
    np.testing.assert_array_equal(dense[2], sparse[2].toarray())


@pytest.mark.parametrize("name", ["bennett", "parallel_four_bars", "chain_and_lag"])
def test_the_start_is_the_same(name, monkeypatch):
    """With redundant rows and with welds; and rows can be chosen anew."""
    dense = model(name)
    monkeypatch.setattr(model_module, "SPARSE_ROWS", 0)
    sparse = model(name)
    assert len(sparse.start.active) == len(dense.start.active)
    np.testing.assert_allclose(sparse.start.q, dense.start.q, atol=1e-12)
    np.testing.assert_allclose(sparse.start.v, dense.start.v, atol=1e-9)
    simulation = Simulation(sparse)
    simulation.advance(0.05)
    assert simulation.reorder()


def test_a_long_chain_is_built_without_a_dense_jacobian(monkeypatch):
    """Its 840 rows and 980 columns are 6.6 MB each; a thousand bodies would take 340 MB and minutes."""

    def forbidden(*_):
        raise AssertionError("dense")

    monkeypatch.setattr(Model, "constraint_jacobian", forbidden)
    assert len(Model(chain(140)).start.active) == 840

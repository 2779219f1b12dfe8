"""One mechanism of each family for a short while; tests/benchmarks/mechanisms.py runs hundreds for long."""

from __future__ import annotations

import pytest

from tests.dms_core.mechanisms.study import ENERGY, FAMILIES, FINE, study


@pytest.mark.parametrize("seed", range(len(FAMILIES)))
def test_it_runs_keeps_its_energy_and_both_methods_agree(seed):
    row = study(seed, 0.3)
    assert row.finished, row.said
    assert row.freedoms >= 1
    assert row.energy < ENERGY
    assert row.difference < FINE

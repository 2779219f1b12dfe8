"""One mechanism of each family for a short while; tests/benchmarks/mechanisms.py runs hundreds for long."""

from __future__ import annotations

import pytest

from tests.dms_core.mechanisms.study import ENERGY, FAMILIES, FINE, study

LONG = (0, 7)
"""Seeds of mechanisms that take ten times longer than the others: many bodies, and a second, finer run."""
SEEDS = [pytest.param(k, marks=pytest.mark.slow) if k in LONG else k for k in range(len(FAMILIES))]


@pytest.mark.parametrize("seed", SEEDS)
def test_it_runs_keeps_its_energy_and_both_methods_agree(seed):
    row = study(seed, 0.3)
    assert row.finished, row.said
    assert row.freedoms >= 1
    assert row.energy < ENERGY
    assert row.difference < FINE

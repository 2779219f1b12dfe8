"""Force curves against the tables of tests/reference (OpenSim 4.6 and the formulas of the paper)."""

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.muscles.thelen_curves import (
    ThelenCurves,
    active_force,
    force_velocity,
    passive_force,
    tendon_force,
)
from tests.arm26 import subject, table

CURVES = {"arm26": ThelenCurves(**subject()["muscle_defaults"]["curves"]), "young_adult": ThelenCurves()}
TOLERANCE = 1e-9
"""Absolute up to 1, relative above: the reference's own advice; its tables carry 12 digits."""


def assert_close(found, wanted):
    found, wanted = np.array(found), np.array(wanted)
    assert np.all(np.abs(found - wanted) <= TOLERANCE * np.maximum(1.0, np.abs(wanted)))


@pytest.mark.parametrize("who", CURVES)
class TestAgainstTables:
    def test_active_and_passive(self, who):
        c, rows = CURVES[who], table(f"thelen_force_length_{who}")
        lengths = [row["fibre_length_over_optimal"] for row in rows]
        active = [active_force(x, c.active_shape)[0] for x in lengths]
        passive = [passive_force(x, c.passive_shape, c.passive_strain)[0] for x in lengths]
        assert_close(active, [row["active_multiplier_opensim"] for row in rows])
        assert_close(passive, [row["passive_multiplier_opensim"] for row in rows])

    def test_tendon(self, who):
        c, rows = CURVES[who], table(f"thelen_tendon_{who}")
        found = [tendon_force(row["tendon_strain"], *c.toe())[0] for row in rows]
        assert_close(found, [row["tendon_force_over_max_isometric_opensim"] for row in rows])

    def test_tendon_with_rounded_constants(self, who):
        c = CURVES[who].model_copy(update={"tendon_constants": "rounded"})
        # The paper's formula is not cut at zero strain; ours is.
        rows = [row for row in table(f"thelen_tendon_{who}") if row["tendon_strain"] >= 0.0]
        found = [tendon_force(row["tendon_strain"], *c.toe())[0] for row in rows]
        assert_close(found, [row["tendon_force_over_max_isometric_paper_formula_unclamped"] for row in rows])

    def test_force_velocity(self, who):
        c, rows = CURVES[who], table(f"thelen_force_velocity_{who}")
        shape = c.velocity_shape, c.lengthening_force
        found = [force_velocity(row["fibre_velocity_over_max_opensim"], row["activation"], *shape)[0] for row in rows]
        assert_close(found, [row["force_velocity_multiplier"] for row in rows])


def test_exact_tendon_reaches_maximum_force_at_its_strain_without_a_corner():
    e_toe, k_lin = ThelenCurves().toe()
    assert tendon_force(0.04, e_toe, k_lin)[0] == pytest.approx(1.0, abs=1e-14)
    # Both branches at the junction: 1e-12 is the share of one rounding error in the slope.
    assert tendon_force(e_toe, e_toe, k_lin)[1] == pytest.approx(k_lin, rel=1e-12)


@pytest.mark.parametrize("activation", [0.01, 0.4, 1.0])
def test_force_velocity_rises_everywhere(activation):
    w = np.linspace(-3.0, 3.0, 601)
    found = np.array([force_velocity(x, activation, 0.3, 1.8)[:2] for x in w])
    assert np.all(found[:, 1] > 0.0)
    assert np.all(np.diff(found[:, 0]) > 0.0)


@pytest.mark.parametrize("key", ["tendon_strain", "active_shape", "lengthening_force"])
def test_impossible_shapes_are_named(key):
    with pytest.raises(ModelError, match=key):
        ThelenCurves(**{key: -1.0})

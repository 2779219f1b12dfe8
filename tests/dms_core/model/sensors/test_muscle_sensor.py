"""What the muscle sensor gives against the equilibrium table."""

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.element import GROUND
from dms_core.model.geometry.path import PathPoint
from dms_core.model.sensors.muscle import UNITS, MuscleSensor, muscle_sensor
from tests.arm26 import arm, muscle, table


def _sensed(row) -> dict[str, float]:
    """All components of a muscle between two points of the ground, resting as the row says."""
    length, a = row["muscle_tendon_length_m"], row["activation"]
    ends = tuple(PathPoint(body=GROUND, point=(x, 0.0, 0.0)) for x in (0.0, length))
    m = muscle(row["muscle"], path=ends, start_activation=a)
    probe = MuscleSensor(name="probe", muscle=m.name, components=tuple(UNITS))
    p = probe.place(arm(0.0, m))
    q, v = np.array([row["fibre_length_m"], a]), np.array([0.0, 0.0])
    y, zero = np.full(len(UNITS), np.nan), np.zeros((len(UNITS), 2))
    ip, par = np.array(p.integers, np.int32), np.array(p.numbers)
    muscle_sensor(ip, par, q, v, v, v, np.zeros((1, 3)), 0, y, *[zero] * 5)
    return dict(zip(UNITS, y, strict=True))


@pytest.mark.parametrize("row", table("muscle_equilibrium")[::7], ids=lambda r: f"{r['muscle']}-{r['activation']}")
def test_against_the_equilibrium_table(row):
    found = _sensed(row)
    # The table's lengths have 12 digits, 1e-13 m; times a tendon's 1e6 N/m this is far below its 1e-5 N.
    for key, column in (
        ("tendon_force", "tendon_force_N"),
        ("active_force", "active_fibre_force_N"),
        ("passive_force", "passive_fibre_force_N"),
    ):
        assert found[key] == pytest.approx(row[column], abs=1e-4), key
    assert found["pennation"] == pytest.approx(row["pennation_rad"], abs=1e-9)
    assert found["length"] == pytest.approx(row["muscle_tendon_length_m"], abs=1e-15)
    assert found["fibre_length"] == row["fibre_length_m"]
    assert found["activation"] == row["activation"]
    assert (found["rate"], found["fibre_velocity"]) == (0.0, 0.0)


def test_names_and_units():
    probe = MuscleSensor(name="probe", muscle="BRA", components=("activation", "tendon_force"))
    assert probe.outputs() == (("activation", "-"), ("tendon_force", "N"))
    assert MuscleSensor(name="emg", muscle="BRA", components=("activation",)).outputs() == (("", "-"),)


def test_mistakes_name_the_culprit():
    with pytest.raises(ModelError, match=r"'base' is a rigid_body. Expected the name of a ThelenMuscle.*BRA"):
        MuscleSensor(name="probe", muscle="base").place(arm(0.0, muscle("BRA")))
    with pytest.raises(ModelError, match="named twice"):
        MuscleSensor(name="probe", muscle="BRA", components=("activation", "activation"))

"""Numbers of figures and films: prefixes in place of powers of ten, no minus before a zero."""

import pytest

from exo_env.rendering.quantities import fixed, quantity
from exo_env.rendering.scales import round_up


@pytest.mark.parametrize(
    "value, unit, said",
    [
        (14742.0, "N/rad", "14.7 kN/rad"),
        (8845.0, "N/rad", "8.84 kN/rad"),
        (653.0, "N/(rad s)", "653 N/(rad s)"),
        # Three digits of it are 1000.
        (999.7, "N", "1 kN"),
        (-1234.0, "Nm", "-1.23 kNm"),
        (2.2e-6, "m", "2.2 \u00b5m"),
        (1000.0, "N", "1 kN"),
        (100.0, "N", "100 N"),
        (0.45, "Nm", "0.45 Nm"),
        (-0.0, "N", "0 N"),
        (0.004, "deg", "0.004 deg"),
        (2500.0, "deg", "2500 deg"),
        (1500.0, "kg", "1500 kg"),
        (0.25, "-", "0.25"),
    ],
)
def test_quantities_have_prefixes_and_no_powers_of_ten(value, unit, said):
    assert quantity(value, unit) == said


@pytest.mark.parametrize("value", [-0.0, -0.04, 0.04, -1e-9])
def test_what_is_rounded_to_zero_has_no_sign(value):
    assert fixed(value, 1) == fixed(value, 1, sign=True) == "0.0"


def test_other_numbers_keep_theirs():
    assert fixed(-0.06, 1) == "-0.1" and fixed(0.26, 1, sign=True) == "+0.3" and fixed(3.0, 0) == "3"


@pytest.mark.parametrize("value", [1e-4, 0.09, 0.1, 0.11, 1.0, 9.99, 10.0, 199.0, 200.0, 201.0])
def test_the_next_round_number_is_near_above(value):
    assert value <= round_up(value) <= 2.0 * value
    assert len(f"{round_up(value):.15g}".strip("0.")) == 1

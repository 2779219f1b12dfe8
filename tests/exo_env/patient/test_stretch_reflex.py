"""The stretch reflex by rate and length: its threshold against the line of the publications, and at rest."""

import math

import numpy as np
import pytest

from exo_env.patient.excitation.stretch_reflex import stretch_reflex
from exo_env.patient.patient import MIDDLE, Patient
from tests.exo_env.patient.at_work import MUSCLES, SIGN, AtWork

SPASTIC = {"spasticity_flexors": 0.3, "spasticity_extensors": 0.1, "stretch_threshold": 0.8}
FLEXES = np.array(SIGN) > 0


def reflex(sign, angle, rate, **fields):
    return stretch_reflex(Patient(**{**SPASTIC, **fields}).row(), sign, angle, rate)


@pytest.mark.parametrize("angle_deg", [10.0, 60.0, 120.0])
def test_without_a_slope_the_length_does_not_count(angle_deg):
    angle = math.radians(angle_deg)
    assert reflex(1.0, angle, -1.8) == pytest.approx(0.3 * 1.0, rel=1e-14)
    assert reflex(-1.0, angle, 1.8) == pytest.approx(0.1 * 1.0, rel=1e-14)
    assert reflex(1.0, angle, 1.8) == reflex(-1.0, angle, -1.8) == reflex(1.0, angle, -0.8) == 0.0


@pytest.mark.parametrize(("sign", "gain"), [(1.0, 0.3), (-1.0, 0.1)])
@pytest.mark.parametrize("mu", [0.4, 1.0])
def test_the_threshold_angle_falls_in_proportion_to_the_rate_of_stretch(sign, gain, mu):
    """Dynamic thresholds x = x_0 - mu v, found by bisection over the angle, against mu = 1 / slope."""
    found = []
    for stretch in (0.2, 0.9, 1.5):
        low, high = -2.0, 2.0
        for _ in range(60):
            x = 0.5 * (low + high)
            silent = reflex(sign, MIDDLE - sign * x, -sign * stretch, stretch_threshold_slope=1.0 / mu) == 0.0
            low, high = (x, high) if silent else (low, x)
        found.append(low)
    assert np.diff(found) == pytest.approx(-mu * np.diff([0.2, 0.9, 1.5]), abs=1e-12)
    assert found[0] == pytest.approx(0.8 * mu - 0.2 * mu, abs=1e-12)
    # Beyond it the reflex grows by the gain, with rate and with length.
    at = MIDDLE - sign * (found[1] + 0.1)
    assert reflex(sign, at, -sign * 0.9, stretch_threshold_slope=1.0 / mu) == pytest.approx(gain * 0.1 / mu, rel=1e-9)
    assert reflex(sign, at, -sign * 1.0, stretch_threshold_slope=1.0 / mu) == pytest.approx(
        gain * (0.1 / mu + 0.1), rel=1e-9
    )


def test_a_muscle_beyond_its_tonic_threshold_contracts_at_rest_from_the_start_on():
    """Where the elbow is straight, and not where it is flexed."""
    work = AtWork(Patient(**SPASTIC, stretch_threshold_slope=1.5), 0.02, np.random.default_rng(0))
    calm, straight = np.full(len(MUSCLES), 0.05), math.radians(20.0)
    assert np.all(work.reset(calm, angle=math.radians(50.0)) == 0.05)
    start = work.reset(calm, angle=straight)
    tonic = 0.3 * (1.5 * (MIDDLE - straight) - 0.8)
    np.testing.assert_allclose(start[FLEXES], 0.05 + tonic, rtol=1e-14)
    assert np.all(start[~FLEXES] == 0.05) and tonic > 0.05
    for _ in range(5):
        np.testing.assert_allclose(work.step(calm, angle=straight), start, rtol=1e-14)

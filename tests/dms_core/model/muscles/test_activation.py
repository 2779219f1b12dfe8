"""Activation dynamics against the table of an excitation step, and its limits."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dms_core.model.muscles.activation import MINIMUM, activation_rate, limited
from tests.arm26 import subject, table

TAU = tuple(subject()["muscle_defaults"][f"{which}_time_constant"] for which in ("activation", "deactivation"))


def _course(t, u, start):
    """Activations at times t under a constant excitation."""
    return solve_ivp(
        lambda _, a: [activation_rate(a[0], u, *TAU)[0]], (t[0], t[-1]), [start], t_eval=t, rtol=1e-11, atol=1e-13
    ).y[0]


def test_excitation_step():
    rows = table("isometric_excitation_step_BIClong")
    time, wanted = (np.array([row[key] for row in rows]) for key in ("time_s", "activation"))
    a = np.full(len(time), wanted[0])
    for begin, end, u in ((0.05, 0.30, 1.0), (0.30, time[-1], 0.05)):
        part = (time >= begin - 1e-9) & (time <= end + 1e-9)
        a[part] = _course(time[part], u, a[part][0])
    # The reference's own tolerance; two integrators of accuracy 1e-11 agree far better.
    np.testing.assert_allclose(a, wanted, rtol=0.0, atol=1e-8)
    assert wanted.max() > 0.99


def test_excitation_is_limited():
    assert limited(-1.0) == (MINIMUM, 0.0)
    assert limited(0.3) == (0.3, 1.0)
    assert limited(1.5) == (1.0, 0.0)


@pytest.mark.parametrize("a", [-5.0, -1.0 / 3.0, 0.0, 0.3])
def test_rate_points_to_the_excitation_even_for_wild_iterates(a):
    rate, by_a, _ = activation_rate(a, 0.5, *TAU)
    assert np.isfinite(rate) and rate > 0.0
    assert by_a < 0.0

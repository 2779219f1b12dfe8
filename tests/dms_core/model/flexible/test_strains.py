"""Strain measures: what no rigid motion changes, the turn in closed form, the seam of series and closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.model.flexible.beams import strains as strain
from dms_core.model.flexible.beams.beam_element import beam_forces
from dms_core.model.geometry.frames import quaternion, quaternion_product, rotation_matrix
from tests.example_elements.flexible import beam
from tests.example_elements.kernel_call import kernel_calls


@pytest.mark.parametrize("angle", [1e-9, 0.03, 0.19, 0.2, 0.21, 1.5, 3.1])
def test_turn_is_the_rotation_vector(angle):
    axis = np.array([0.36, -0.48, 0.8])
    c = tuple(1.7 * quaternion(axis, angle))
    turn = strain.turn(c, strain.turn_factors(c))
    np.testing.assert_allclose(turn, angle * axis, rtol=1e-14, atol=1e-16)


def test_series_meet_the_closed_form():
    """f, h and k on both sides of the seam: as far apart as their slopes say, but for rounding."""
    e = math.sqrt(strain.NEAR)
    for k, tolerance in enumerate((1e-14, 1e-12, 1e-10)):
        # The closed form of h loses two digits there, that of k four.
        below, above = (strain.turn_factors((1.0, e * x, 0.0, 0.0))[k] for x in (1.0 - 1e-9, 1.0 + 1e-9))
        middle = 0.5 * (below + above)
        assert abs(above - below) < (3e-9 + tolerance) * abs(middle)
    # At 0 they are those of atan(x) / x = 1 - x^2/3 + x^4/5.
    assert strain.turn_factors((1.0, 0.0, 0.0, 0.0)) == pytest.approx((1.0, -2.0 / 3.0, 1.6), rel=1e-15)


@pytest.mark.parametrize("flipped", [False, True])
def test_no_rigid_motion_changes_a_section_load(flipped):
    """Both nodes moved as one body, and with the other sign of one's Euler parameters, which is the same place."""
    call = kernel_calls(beam())[0]
    par, q = np.array(call.placement.numbers), call.random_point(0).q
    p, shift = quaternion((1.0, -2.0, 0.5), 2.5), np.array([3.0, -1.0, 2.0])
    moved = q.copy()
    for o in (0, 7):
        moved[o : o + 3] = shift + rotation_matrix(p) @ q[o : o + 3]
        moved[o + 3 : o + 7] = quaternion_product(p, q[o + 3 : o + 7])
    if flipped:
        moved[10:] *= -1.0
    still = 0.0 * q
    for one, other in zip(beam_forces(par, q, still), beam_forces(par, moved, still), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)

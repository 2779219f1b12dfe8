"""Paths of equilibria: snap-through of von Mises' truss, buckling of columns of links."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.analyses import follow_path
from dms_core.errors import InputError
from tests.dms_core.analyses.mechanisms import column, von_mises_truss

B, H, K = 1.0, 0.3, 1000.0
FULL = 20.0
"""Half span [m], height [m], stiffness of a bar [N/m] and force at load factor 1 [N]."""
L0 = math.hypot(B, H)


def force(y):
    """Force that holds the node at height y: 2 k y (L0 / L - 1), L = sqrt(b^2 + y^2).

    The truss of von Mises (1923) with bars that are linear springs; e.g. Bazant and Cedolin, Stability of Structures
    (1991), sect. 4.4.
    """
    return 2.0 * K * y * (L0 / np.sqrt(B * B + y * y) - 1.0)


def limit_height() -> float:
    """dP/dy = 0: L^3 = L0 b^2."""
    return math.sqrt((L0 * B * B) ** (2.0 / 3.0) - B * B)


@pytest.fixture(scope="module")
def path():
    return follow_path(von_mises_truss(B, H, K, FULL), ["P"], to=1.0)


class TestSnapThrough:
    def test_every_point_is_on_the_closed_form(self, path):
        y = path.states().coordinate("node.y")
        np.testing.assert_allclose(FULL * path.loads, force(y), atol=1e-8)
        assert path.reached
        assert path.loads[-1] == pytest.approx(1.0, abs=1e-12)
        # It goes from one side to the other.
        assert y[0] == pytest.approx(H, abs=1e-9)
        assert y[-1] < -H

    def test_limit_loads(self, path):
        """At a limit point dP/dy = 0, so that its load is known to the square of what is left in y."""
        up, down = path.limit_points
        assert FULL * up.load == pytest.approx(force(limit_height()), rel=1e-9)
        assert FULL * down.load == pytest.approx(-force(limit_height()), rel=1e-9)
        assert up.words.startswith("'node' moves along (0, 1, 0)")

    def test_stable_before_the_first_limit_point_and_behind_the_second(self, path):
        y = path.states().coordinate("node.y")
        away = np.abs(np.abs(y) - limit_height()) > 1e-6
        np.testing.assert_array_equal(path.stable[away], (np.abs(y) > limit_height())[away])
        assert path.stable.any() and not path.stable.all()

    def test_backwards_too(self):
        back = follow_path(von_mises_truss(B, H, K, FULL), ["P"], to=-0.7, load=0.2)
        assert back.reached
        assert len(back.limit_points) == 0
        assert np.all(np.diff(back.loads) < 0.0)


class TestBuckling:
    @pytest.mark.parametrize(
        ("links", "share"),
        [
            # One link: k phi = P L sin(phi).  Two: (2k - P L)(k - P L) = k^2, P L / k = (3 - sqrt 5) / 2.
            (1, 1.0),
            (2, 0.5 * (3.0 - math.sqrt(5.0))),
        ],
    )
    def test_critical_load_of_links_with_torsion_springs(self, links, share):
        """Simitses and Hodges, Fundamentals of Structural Stability (2006), ch. 2: systems of rigid links."""
        k, length = 50.0, 0.8
        critical = share * k / length
        path = follow_path(column(links, length, k, 2.0 * critical), ["P"], to=0.9, longest=0.13)
        bifurcation = path.events[0]
        assert bifurcation.kind == "bifurcation"
        # Newton's matrix is singular there, so that the load is interpolated between places 1e-5 apart.
        assert bifurcation.load == pytest.approx(0.5, rel=1e-6)
        np.testing.assert_array_equal(path.stable, path.loads < 0.5)
        assert "turns about (0, 0, 1)" in bifurcation.words

    def test_unloaded_column_is_stable_in_one_step(self):
        path = follow_path(column(1, 1.0, 10.0, 1.0), ["P"], to=0.5)
        assert path.reached and path.stable.all() and not path.events


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"loads": []}, "loads: Expected the names of the loads that grow"),
        ({"loads": ["P"], "to": 0.0}, "to: Expected a finite load factor other than the first"),
        ({"loads": ["Q"]}, "load 'Q': Expected an input"),
        ({"loads": ["P"], "longest": 0.0}, "longest: Expected a positive arc length, got 0.0."),
    ],
)
def test_wrong_arguments(arguments, said):
    with pytest.raises(InputError) as error:
        follow_path(von_mises_truss(B, H, K, FULL), **arguments)
    assert said in str(error.value)


def test_a_path_that_does_not_get_there_says_so():
    short = follow_path(von_mises_truss(B, H, K, FULL), ["P"], to=1.0, max_points=5)
    assert not short.reached
    assert len(short.points) == 5

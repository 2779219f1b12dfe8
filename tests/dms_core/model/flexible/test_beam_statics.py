"""Beams at rest against closed forms, the elastica, and published large deflections in space."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from dms_core.model import BeamSection
from tests.dms_core.model.flexible.beams import EI, SLENDER, cantilever, tip
from tests.dms_core.model.flexible.equilibrium import at_rest, equilibrium, frequencies

THICK = BeamSection(
    youngs_modulus=2e11, shear_modulus=8e10, area=0.02, inertia_y=2e-5, inertia_z=6e-5, torsion_constant=3e-5,
    shear_factor_y=0.85, shear_factor_z=0.8, density=7800.0,
)  # fmt: skip
"""Shear is a fifth of the deflection over 1 m."""


@pytest.mark.parametrize("elements", [1, 3])
@pytest.mark.parametrize(
    ("load", "component", "compliance"),
    [
        ({"force": (1.0, 0.0, 0.0)}, 0, 1.0 / (2e11 * 0.02)),
        ({"force": (0.0, 1.0, 0.0)}, 1, 1.0 / (3 * 2e11 * 6e-5) + 1.0 / (0.85 * 8e10 * 0.02)),
        ({"force": (0.0, 0.0, 1.0)}, 2, 1.0 / (3 * 2e11 * 2e-5) + 1.0 / (0.8 * 8e10 * 0.02)),
        ({"moment": (0.0, 0.0, 1.0)}, 1, 1.0 / (2 * 2e11 * 6e-5)),
        ({"moment": (0.0, 1.0, 0.0)}, 2, -1.0 / (2 * 2e11 * 2e-5)),
    ],
)
def test_small_deflections_are_exact_at_the_nodes(elements, load, component, compliance):
    """Timoshenko's cantilever of 1 m with any number of elements: PL^3/3EI + PL/kGA, ML^2/2EI, PL/EA."""
    model = cantilever(elements, THICK, **load)
    moved = tip(model, equilibrium(model, load=1.0).q)[component] - (1.0 if component == 0 else 0.0)
    # Deflections of 1e-8 m beside lengths of 1 m hold eight digits.
    assert moved == pytest.approx(compliance, rel=1e-6)


def test_torque_twists_by_its_length_over_gj():
    model = cantilever(2, THICK, moment=(1e3, 0.0, 0.0))
    q = equilibrium(model, load=1.0).q
    assert 2.0 * math.atan2(q[-3], q[-4]) == pytest.approx(1e3 / (8e10 * 3e-5), rel=1e-9)


def elastica(alpha: float) -> tuple[float, float]:
    """Tip (x, y) over the length of an inextensible cantilever under P across it at its tip, alpha = P L^2 / EI.

    K. E. Bisshopp and D. C. Drucker (1945), Q. Appl. Math. 3(3):272-275: with the tip's slope theta,
    k^2 = (1 + sin theta) / 2, sin phi = 1 / (k sqrt 2):  sqrt alpha = K(k) - F(phi, k),
    y = 1 - 2 (E(k) - E(phi, k)) / sqrt alpha,  x = sqrt(2 sin theta / alpha).
    """

    def rest(sine: float) -> float:
        m = 0.5 * (1.0 + sine)
        return ellipk(m) - ellipkinc(math.asin(1.0 / math.sqrt(2.0 * m)), m) - math.sqrt(alpha)

    sine = brentq(rest, 1e-12, 1.0 - 1e-14, xtol=1e-15)
    m = 0.5 * (1.0 + sine)
    phi, root = math.asin(1.0 / math.sqrt(2.0 * m)), math.sqrt(alpha)
    return math.sqrt(2.0 * sine / alpha), 1.0 - 2.0 * (ellipe(m) - ellipeinc(phi, m)) / root


@pytest.mark.parametrize(("alpha", "published"), [(1.0, (0.9436, 0.3017)), (10.0, (0.4450, 0.8106))])
def test_elastica_and_its_order(alpha, published):
    """Errors fall with the square of the elements' length; what is extrapolated is the elastica.

    Published: table 1 of K. Mattiasson (1981), Int. J. Numer. Methods Eng. 17:145-153, to four digits.
    """
    truth = np.array(elastica(alpha))
    np.testing.assert_allclose(truth, published, atol=1e-4)
    found = []
    for elements in (8, 16, 32):
        model = cantilever(elements)
        found.append(tip(model, equilibrium(model, 0.2, load=alpha * EI).q)[:2])
    errors = [np.linalg.norm(x - truth) for x in found]
    assert 3.7 < errors[0] / errors[1] < 4.3
    assert 3.7 < errors[1] / errors[2] < 4.3
    # Stretch and shear of the beam are a share of 1e-5 at this load.
    np.testing.assert_allclose((4.0 * found[2] - found[1]) / 3.0, truth, atol=3e-5)


@pytest.mark.parametrize("elements", [4, 10])
def test_an_end_moment_rolls_it_up_into_a_full_circle(elements):
    """M = 2 pi EI / L: the tip comes back to the clamp, exactly, as a polygon does, and after two turns again."""
    model = cantilever(elements, moment=(0.0, 0.0, 1.0), axes="body")
    # An element may turn by less than half a turn.
    for turns in (1, 2) if elements > 4 else (1,):
        at = equilibrium(model, 0.125, load=2.0 * math.pi * EI * turns)
        np.testing.assert_allclose(tip(model, at.q), 0.0, atol=1e-12)
        # The last section has turned fully: its Euler parameters have changed sign once a turn.
        np.testing.assert_allclose(at.q[-4:], [(-1.0) ** turns, 0.0, 0.0, 0.0], atol=1e-12)


PRINCETON = BeamSection.rectangle(12.3777e-3, 3.2024e-3, 71.7e9, 0.31, 2700.0)
"""Width along y, thickness along z, of the beam of E. H. Dowell and J. Traybar (1975), Princeton AMS report 1194, with
the dimensions used by Obrezkov and others."""
LOADED = {
    8.896: (
        (1.071417630e-2, 1.061328706e-2, 1.011169630e-2, 8.837226265e-3, 6.604665004e-3, 3.538889001e-3, 0.0),
        (0.0, 4.208232124e-2, 7.939482948e-2, 0.108987937, 0.129887616, 0.142194370, 0.146245978),
    ),
    13.345: (
        (1.606423724e-2, 1.645825752e-2, 1.665873206e-2, 1.518618440e-2, 1.157837500e-2, 6.248967384e-3, 0.0),
        (0.0, 6.435812858e-2, 0.117735994, 0.156467239, 0.181861627, 0.196097131, 0.200677707),
    ),
}
"""Tip deflections along y and z [m] by load [N], for 0, 15, ..., 90 degrees between the load and y: a fine mesh of
ANSYS beams, L. Obrezkov, P. Eliasson, A. B. Harish, M. K. Matikainen (2022), Nonlinear Dyn. 109:31-54, as quoted in
Exudyn's test ANCFBeamTest.py."""


@pytest.mark.parametrize("load", LOADED)
@pytest.mark.parametrize("k", range(7))
def test_princeton_beam(load, k):
    """A flat cantilever of 0.508 m that bends both ways and twists."""
    angle = math.radians(15.0 * k)
    model = cantilever(16, PRINCETON, 0.508, force=(0.0, math.cos(angle), math.sin(angle)))
    y, z = tip(model, equilibrium(model, 0.2, load=load).q)[1:]
    # Half a millimetre, a quarter of a per cent of the largest deflection: other beams and solids differ by as much.
    assert y == pytest.approx(LOADED[load][0][k], abs=2e-4)
    assert z == pytest.approx(LOADED[load][1][k], abs=5e-4)


def test_arc_under_a_load_across_its_plane():
    """45 degrees of a circle of 100 in, section 1 in x 1 in, E = 1e7 psi, nu = 0: K.-J. Bathe and S. Bolourchi (1979).

    Int. J. Numer. Methods Eng. 14:961-986 gives the tip at (47.2, 15.9, 53.4) for 600 lb; J. C. Simo and L. Vu-Quoc
    (1986), Comput. Methods Appl. Mech. Eng. 58:79-116, (47.23, 15.79, 53.37), and for 300 lb (58.84, 22.33, 40.08);
    both with eight elements. They spread by 0.1 in, and so may we.
    """
    section = BeamSection(
        youngs_modulus=1e7, shear_modulus=5e6, area=1.0, inertia_y=1.0 / 12.0, inertia_z=1.0 / 12.0,
        torsion_constant=1.0 / 6.0, shear_factor_y=5.0 / 6.0, shear_factor_z=5.0 / 6.0, density=1.0,
    )  # fmt: skip
    model = cantilever(8, section, 25.0 * math.pi, curvature=(0.0, 0.0, 0.01), force=(0.0, 0.0, 1.0))
    root = 50.0 * math.sqrt(2.0)
    np.testing.assert_allclose(tip(model, model.start.q), [root, 100.0 - root, 0.0], atol=1e-9)
    np.testing.assert_allclose(tip(model, equilibrium(model, 0.2, load=300.0).q), [58.84, 22.33, 40.08], atol=0.15)
    np.testing.assert_allclose(tip(model, equilibrium(model, 0.2, load=600.0).q), [47.23, 15.79, 53.37], atol=0.2)


def test_euler_buckling():
    """The lowest frequency of a cantilever under its axial load falls to 0 at P = pi^2 EI / (4 L^2)."""
    critical = math.pi**2 * EI / 4.0
    model = cantilever(16, SLENDER, force=(-1.0, 0.0, 0.0))
    squares = []
    for share in (0.90, 0.98):
        at = equilibrium(model, load=share * critical)
        squares.append(frequencies(model, at, 1)[0] ** 2)
    crossing = 0.98 + 0.08 * squares[1] / (squares[0] - squares[1])
    # Elements of L/16 err by 1e-4 to 1e-3; the square of the frequency is not quite a line in the load.
    assert crossing == pytest.approx(1.0, abs=3e-3)
    assert frequencies(model, at_rest(model), 1)[0] ** 2 > 5.0 * squares[0]

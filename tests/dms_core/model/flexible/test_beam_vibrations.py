"""Natural frequencies of beams against Euler-Bernoulli's and Timoshenko's, with both masses; order in elements."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.model import Beam, BeamSection, Fixed, LineGuide, Revolute, System
from tests.dms_core.model.flexible.beams import SLENDER, cantilever
from tests.dms_core.model.flexible.equilibrium import at_rest, frequencies

BENDING = math.sqrt(200.0 / 7.8)
"""sqrt(EI / rho A) of SLENDER about z [m^2/s]; about y it is sqrt 2 times as much."""
CLAMPED_FREE = (1.87510407, 4.69409113, 7.85475744)
"""beta L with cosh cos = -1 (Rao, Mechanical Vibrations, table of section 8.5)."""
MASSES = pytest.mark.parametrize("mass", ["lumped", "consistent"])


def nearest(found: np.ndarray, wanted: float) -> float:
    """Of some frequencies the one that is meant."""
    return float(found[np.argmin(np.abs(np.log(np.maximum(found, 1e-3) / wanted)))])


def cantilever_errors(elements: int, mass: str) -> np.ndarray:
    """Of the first three frequencies about z, against Euler and Bernoulli's [-]."""
    model = cantilever(elements, mass=mass)
    wanted = [b**2 * BENDING for b in CLAMPED_FREE]
    found = frequencies(model, at_rest(model), 10)
    return np.array([nearest(found, w) / w - 1.0 for w in wanted])


def test_lumped_mass_is_of_order_two():
    """From below, as what vibrates between the nodes is put on them."""
    coarse, fine = (cantilever_errors(n, "lumped") for n in (8, 16))
    assert np.all(fine < 0.0)
    assert np.abs(fine).max() < 0.011
    assert np.all((3.4 < coarse / fine) & (coarse / fine < 4.4))


def test_consistent_mass_is_of_order_four():
    """From above; of eight elements the first three frequencies are right to half a per mille."""
    # Rotary inertia and shear take 8e-6, 5e-5 and 1.3e-4 off Euler and Bernoulli's: told by a fine mesh.
    offset = cantilever_errors(32, "consistent")
    np.testing.assert_allclose(offset, [-8e-6, -5.6e-5, -1.33e-4], rtol=0.05)
    coarse, fine = (cantilever_errors(n, "consistent") - offset for n in (4, 8))
    assert np.all(fine > 0.0)
    assert np.abs(fine).max() < 7e-4
    assert np.all((11.0 < coarse / fine) & (coarse / fine < 18.0))


@pytest.mark.parametrize(("mass", "tolerance"), [("lumped", 0.015), ("consistent", 1e-4)])
def test_free_beam(mass, tolerance):
    """Six rigid motions of frequency 0, then beta L = 4.73004074."""
    beam = Beam(name="boom", section=SLENDER, length=1.0, elements=16, mass=mass)
    model = Model(System("free", compositions=[beam]))
    found = frequencies(model, at_rest(model), 10)
    # Squares of 1e9 / s^2 and rounding: 1e-7 of the highest frequency of the mesh.
    assert found[:6].max() < 1.0
    assert found[6] == pytest.approx(4.73004074**2 * BENDING, rel=tolerance)


THICK = BeamSection(
    youngs_modulus=2e11, shear_modulus=7.7e10, area=0.02, inertia_y=6e-5, inertia_z=2e-5, torsion_constant=5e-5,
    shear_factor_y=0.85, shear_factor_z=0.85, density=7800.0,
)  # fmt: skip


def timoshenko(n: int, inertia: float, k: float = 0.85) -> float:
    """Lowest root w of mode n of a pinned beam of 1 m [rad/s]: with c = n pi / L,

    EI c^4 - w^2 (rho A + rho I c^2 (1 + E / kG)) + w^4 rho^2 I / kG = 0      (Timoshenko 1921, Phil. Mag. 41:744-746)
    """
    E, G, A, rho, c = 2e11, 7.7e10, 0.02, 7800.0, n * math.pi
    b, a = rho * A + rho * inertia * c**2 * (1.0 + E / (k * G)), rho**2 * inertia / (k * G)
    return math.sqrt((b - math.sqrt(b * b - 4.0 * a * E * inertia * c**4)) / (2.0 * a))


def test_pinned_thick_beam_has_timoshenkos_frequencies():
    """Shear and rotary inertia take 2 to 17 per cent off the first two; about both axes."""
    beam = Beam(name="boom", section=THICK, length=1.0, elements=24, mass="consistent")
    for axis, inertia in (((0.0, 0.0, 1.0), 2e-5), ((0.0, 1.0, 0.0), 6e-5)):
        ends = [
            Revolute(name="near", body_j="boom.node0", axis_i=axis),
            LineGuide(name="far", body_j="boom.node24", axis_i=(1.0, 0.0, 0.0), point_j=(0.0, 0.0, 0.0)),
        ]
        model = Model(System("pinned", compositions=[beam], constraints=ends))
        found = frequencies(model, at_rest(model), 12)
        for n in (1, 2):
            wanted = timoshenko(n, inertia)
            assert wanted < (n * math.pi) ** 2 * math.sqrt(2e11 * inertia / (7800.0 * 0.02)) * 0.99
            # Elements of L/24 whose mass does not know the shear: some (n pi / 24)^2 / 24.
            assert nearest(found, wanted) == pytest.approx(wanted, rel=3e-3)


@MASSES
def test_rod_and_shaft(mass):
    """Clamped and free: pi/2 sqrt(E / rho) and pi/2 sqrt(GJ / rho (I_y + I_z)) over the length."""
    beam = Beam(name="boom", section=THICK, length=1.0, elements=16, mass=mass)
    model = Model(System("rod", compositions=[beam], constraints=[Fixed(name="clamp", body_j="boom.node0")]))
    found = frequencies(model, at_rest(model), 12)
    for speed in (math.sqrt(2e11 / 7800.0), math.sqrt(7.7e10 * 5e-5 / (7800.0 * 8e-5))):
        # (pi / 32)^2 / 24 = 4e-4 for both masses, of one sign or the other.
        assert nearest(found, 0.5 * math.pi * speed) == pytest.approx(0.5 * math.pi * speed, rel=6e-4)

"""Two flexible mechanisms that several programs are timed with: their numbers, and where fine solutions end.

Beam: a round beam of rubber, 1 m long and hinged at the origin, lies along +x at rest and swings under gravity for 1 s;
it bends by a fifth of its length. Slider-crank: a moment of 1 N m turns a crank of 0.15 m from rest at 60 degrees for
0.2 s; a steel rod of 0.3 m and 6 mm, that of Jonker (1989), Comput. Methods Appl. Mech. Eng. 76:17-57, goes from its
pin to a slider on the x axis, of half the rod's mass. Both move in the plane; sections are those of Simo and Reissner,
with shear and rotary inertia, no damping.

Numbers only, so that other programs read them without this project's packages.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class RoundSection(NamedTuple):
    """Full round cross-section."""

    radius: float
    """[m]."""
    E: float
    """Young's modulus [Pa]."""
    G: float
    """Shear modulus [Pa]."""
    density: float
    """[kg/m^3]."""
    shear_factor: float = 0.9

    @property
    def area(self) -> float:
        """[m^2]."""
        return math.pi * self.radius**2

    @property
    def inertia(self) -> float:
        """Second moment of area about a diameter [m^4]."""
        return math.pi / 4.0 * self.radius**4


GRAVITY = 9.81
RUBBER = RoundSection(radius=0.02, E=1e7, G=1e7 / 2.6, density=1000.0)
BEAM_LENGTH, BEAM_SECONDS, BEAM_ELEMENTS = 1.0, 1.0, 32

STEEL = RoundSection(radius=0.003, E=2e11, G=7.7e10, density=7870.0)
CRANK, ROD, START, MOMENT, CRANK_INERTIA, CRANK_SECONDS = 0.15, 0.3, math.radians(60.0), 1.0, 5e-3, 0.2
"""Lengths [m], first angle of the crank [rad], its moment [N m], inertia about the bearing [kg m^2], duration [s]."""
SLIDER_MASS = 0.5 * ROD * STEEL.area * STEEL.density

BEAM_TIP = (-0.9879524, 0.0507602)
"""Free end of the beam at the end [m]: limit of ours with 64 and 128 elements by order 2, at rtol 1e-7. Exudyn's
quadratic elements have the limit (-0.9879522, 0.0507608): steps of 0.5 and 0.25 ms, 64 elements."""
ROD_MIDDLE = (0.0469239, -0.0597704)
"""Middle of the rod at the end [m]: ours with 8, 16 and 32 elements at rtol 1e-7, and Exudyn with 16, within 1e-7."""


def rod_start() -> tuple[tuple[float, float], float]:
    """Crank pin [m] and the angle of the rod [rad] at the start."""
    pin = (CRANK * math.cos(START), CRANK * math.sin(START))
    return pin, -math.asin(pin[1] / ROD)

"""Cross-section of a beam: what its stiffness and its mass follow from."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from dms_core.errors import ModelError
from dms_core.validation import Checked, check_sizes


class BeamSection(Checked):
    """Cross-section and material of a beam; y and z are its principal axes, x runs along the beam."""

    wrong = ModelError
    youngs_modulus: float = Field(gt=0.0, description="E [Pa]")
    shear_modulus: float = Field(gt=0.0, description="G [Pa]")
    area: float = Field(gt=0.0, description="A [m^2]")
    inertia_y: float = Field(gt=0.0, description="second moment of area about y, for bending in x-z [m^4]")
    inertia_z: float = Field(gt=0.0, description="second moment of area about z, for bending in x-y [m^4]")
    torsion_constant: float = Field(gt=0.0, description="J [m^4]; that of a circle is inertia_y + inertia_z")
    shear_factor_y: float = Field(default=1.0, gt=0.0, description="k_y of the shear stiffness k_y G A along y [-]")
    shear_factor_z: float = Field(default=1.0, gt=0.0, description="k_z of the shear stiffness k_z G A along z [-]")
    density: float = Field(gt=0.0, description="rho [kg/m^3]")

    def model_post_init(self, _) -> None:
        """Refuse numbers that are no measure of anything."""
        check_sizes(self)

    @property
    def mass_per_length(self) -> float:
        """rho A [kg/m]."""
        return self.density * self.area

    @property
    def inertia_per_length(self) -> tuple[float, float, float]:
        """About x, y and z [kg m]."""
        y, z = self.density * self.inertia_y, self.density * self.inertia_z
        return y + z, y, z

    def stiffnesses(self, length: float) -> tuple[np.ndarray, np.ndarray]:
        """(EA, GA_y, GA_z) [N] and (GJ, EI_y, EI_z) [N m^2] of an element of that length [m].

        The shear stiffnesses are softened by the bending within the element, see beam_element.py.
        """
        E, G, A = self.youngs_modulus, self.shear_modulus, self.area
        bending = length * length / 12.0
        shear_y = 1.0 / (1.0 / (self.shear_factor_y * G * A) + bending / (E * self.inertia_z))
        shear_z = 1.0 / (1.0 / (self.shear_factor_z * G * A) + bending / (E * self.inertia_y))
        return (
            np.array([E * A, shear_y, shear_z]),
            np.array([G * self.torsion_constant, E * self.inertia_y, E * self.inertia_z]),
        )

    @classmethod
    def rectangle(cls, width: float, height: float, youngs_modulus: float, poisson_ratio: float, density: float):
        """A full rectangle, `width` along y and `height` along z.

        Torsion constant of the rectangle to 1e-4 from Saint-Venant's series, shear factors 10 (1 + nu) / (12 + 11 nu)
        (G. R. Cowper (1966), J. Appl. Mech. 33:335-340).
        """
        a, b = max(width, height), min(width, height)
        odd = np.arange(1, 40, 2)
        series = float(np.sum(np.tanh(odd * math.pi * a / (2.0 * b)) / odd**5.0))
        torsion = a * b**3 * (1.0 / 3.0 - 64.0 / math.pi**5 * (b / a) * series)
        k = 10.0 * (1.0 + poisson_ratio) / (12.0 + 11.0 * poisson_ratio)
        return cls(
            youngs_modulus=youngs_modulus, shear_modulus=youngs_modulus / (2.0 * (1.0 + poisson_ratio)),
            area=width * height, inertia_y=width * height**3 / 12.0, inertia_z=height * width**3 / 12.0,
            torsion_constant=torsion, shear_factor_y=k, shear_factor_z=k, density=density,
        )  # fmt: skip

"""The compliant cuff between lower link and forearm: flesh and strap as springs and dampers in six directions."""

from __future__ import annotations

from pydantic import Field, field_validator

from dms_core.model import Bushing
from exo_env.settings import Settings

Six = tuple[float, float, float, float, float, float]
STIFFNESS: Six = (3700.0, 2250.0, 3150.0, 10.6, 2.0, 12.0)
"""Means over both senses of the linear group model of J. Schiebl et al. (2025), Sensors 25(15):4605, appendix B: along
the limb 2.4 and 2.1 N/mm, latero-medial 3.5 and 2.8, across both 3.2 and 4.2; about these axes 0.03 and 0.04 N m/deg,
0.22 and 0.20, 0.18 and 0.19. They were measured at the upper arm of 21 persons; assumed: a cuff at the forearm is the
same."""
DAMPING: Six = (25.0, 20.0, 23.0, 0.2, 0.05, 0.2)
"""Assumed: a third of what is critical for a link of half a kilogram and 0.01 kg m^2."""


class Cuff(Settings):
    """Stiffness and damping of the cuff in the axes of the lower link: x across the forearm, y along it, z the hinge's.

    The cuff is undeformed where an aligned device is: worn askew, it is strained by the misalignment itself.
    """

    stiffness: Six = Field(default=STIFFNESS, description="along x, y, z [N/m], then about them [N m/rad]")
    damping: Six = Field(default=DAMPING, description="along x, y, z [N s/m], then about them [N m s/rad]")

    @field_validator("stiffness", "damping")
    @classmethod
    def _holds(cls, value: Six) -> Six:
        if min(value) < 0.0:
            raise ValueError("expected six numbers of at least 0")
        return value

    @field_validator("stiffness")
    @classmethod
    def _leads(cls, value: Six) -> Six:
        if value[0] == 0.0:
            raise ValueError("expected a first number above 0: without it the cuff does not lead the forearm")
        return value

    def bushing(self, name: str, link: str, at, limb: str, point, orientation) -> Bushing:
        """The element that holds a limb in a link.

        Args:
            name: of the element.
            link: body that carries the cuff; its axes are the cuff's.
            at: centre of the cuff in the link's frame [m].
            limb: body in the cuff.
            point: centre of the cuff in the limb's frame [m].
            orientation: Euler parameters of the cuff's axes in the limb's frame.
        """
        return Bushing(
            name=name, body_i=link, body_j=limb, point_i=tuple(at), point_j=tuple(point),
            orientation_j=tuple(orientation), stiffness=self.stiffness, damping=self.damping,
        )  # fmt: skip

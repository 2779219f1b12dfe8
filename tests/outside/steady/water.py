"""A force: water drags on a body, in proportion to the velocity of its centre of mass. F = -c v."""

from typing import ClassVar

from pydantic import Field

from dms_core.kernels import compiled
from dms_core.model.element import Force, Placement


@compiled
def water_drag(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """par: c."""
    for i in range(3):
        r[i] += par[0] * v[i]
        if level > 0:
            Jv[i, i] += par[0]


class WaterDrag(Force):
    """Viscous drag on a body."""

    kind: ClassVar[str] = "water_drag"
    kernel: ClassVar = water_drag
    body: str = Field(description="that is dragged")
    drag: float = Field(ge=0.0, description="c [N s/m]")

    def place(self, system) -> Placement:
        """One body, one number."""
        return Placement(bodies=(self.body,), numbers=(self.drag,))

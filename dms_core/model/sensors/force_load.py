"""Load with which a force element acts on one of its bodies: a bushing, a spring, a rope, a muscle.

With Q its generalised force on that body, split into Q_r (3) and Q_p (4):

    F = Q_r,     M = E(p) Q_p / 2 - (A s) x F,      E(p) = [-e, p0 I + skew(e)]

force and moment at the point s, in the axes of a frame; what `joint_reaction` is for a constraint.
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.errors import ModelError, choices
from dms_core.model.element import COMPOSITIONS, GROUND, Force, Placement, Sensor, Vector


class ForceLoad(Sensor):
    """Force [N] and moment [Nm] that the element `force` exerts on `body` at `point`, in the axes of `frame`."""

    kind: ClassVar[str] = "force_load"
    composition: ClassVar[int] = COMPOSITIONS.force_load
    force: str = Field(description="bushing, spring, rope, muscle or load whose action is measured")
    body: str = Field(description="body on which it acts")
    point: Vector | None = Field(
        default=None, description="point in the frame of that body [m]; default: the centre of mass"
    )
    frame: str = Field(default=GROUND, description="'ground' or a body on which it acts, whose axes are used")

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Three components of force and of moment."""
        return tuple((f"{c}{axis}", unit) for c, unit in (("F", "N"), ("M", "Nm")) for axis in "xyz")

    def place(self, system) -> Placement:
        """The loaded body, and that of the frame; integers: see COMPOSITIONS."""
        bodies = {b for p in system.element(self.force, Force).placements(system) for b in p.bodies}
        for what, body in (("body", self.body), ("frame", self.frame)):
            if body not in bodies and not (what == "frame" and body == GROUND):
                raise ModelError(
                    f"force_load '{self.name}': '{self.force}' does not act on {what} = '{body}'. "
                    f"It acts on: {choices(bodies)}."
                )
        used = (self.body,) if self.frame in (GROUND, self.body) else (self.body, self.frame)
        frame = -1 if self.frame == GROUND else 7 * used.index(self.frame)
        arm = (0.0, 0.0, 0.0) if self.point is None else system.arm(self.body, self.point)
        return Placement(bodies=used, integers=(frame,), numbers=tuple(float(x) for x in arm), sources=(self.force,))

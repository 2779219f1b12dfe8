"""Reaction of a constraint on one of its bodies (paper Fig. 13).

With Q = -phi_q^T lam, the generalised constraint force on that body, split into Q_r (3) and Q_p (4):

    F = Q_r,     M = E(p) Q_p / 2 - (A s) x F,      E(p) = [-e, p0 I + skew(e)]

force and moment at the point s, exerted on the body through the constraint, given in the axes of a frame. The
multipliers are unique where the constraints are independent; where they are redundant those of least norm are read,
and the reaction is one of many possible ones.
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.errors import ModelError, choices
from dms_core.model.element import COMPOSITIONS, GROUND, Constraint, Placement, Sensor, Vector


class JointReaction(Sensor):
    """Force [N] and moment [Nm] that `constraint` exerts on `body` at `point`, in the axes of `frame`."""

    kind: ClassVar[str] = "joint_reaction"
    composition: ClassVar[int] = COMPOSITIONS.reaction
    constraint: str = Field(description="constraint whose reaction is measured")
    body: str = Field(description="body of that constraint on which the reaction acts")
    point: Vector | None = Field(
        default=None,
        description="point in the frame of that body [m]; default: the joint's own point, or the centre of mass",
    )
    frame: str = Field(default=GROUND, description="'ground' or a body of the constraint, whose axes are used")

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Three components of force and of moment."""
        return tuple((f"{c}{axis}", unit) for c, unit in (("F", "N"), ("M", "Nm")) for axis in "xyz")

    def place(self, system) -> Placement:
        """The constraint's own local coordinates; integers: see COMPOSITIONS."""
        constraint = system.element(self.constraint, Constraint)
        place = constraint.place(system)
        for what, body in (("body", self.body), ("frame", self.frame)):
            if body not in place.bodies and not (what == "frame" and body == GROUND):
                raise ModelError(
                    f"joint_reaction '{self.name}': {what} = '{body}' is not joined by '{self.constraint}'. "
                    f"Its bodies: {choices(place.bodies)}."
                )
        block = place.bodies.index(self.body)
        frame = place.bodies.index(self.frame) if self.frame in place.bodies and self.frame != GROUND else -1
        arm = (0.0, 0.0, 0.0)
        if self.point is not None:
            arm = system.arm(self.body, self.point)
        elif block < len(constraint.own_points):
            first = constraint.own_points[block]
            arm = place.numbers[first : first + 3]
        return Placement(
            bodies=place.bodies,
            coordinates=place.coordinates,
            inputs=place.inputs,
            integers=(7 * block, 7 * frame if frame >= 0 else -1),
            numbers=tuple(float(x) for x in arm),
            constraint=self.constraint,
        )

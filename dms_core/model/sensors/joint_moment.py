"""Equivalent joint moment of a group of elements (paper Fig. 12).

    M = sum over elements and distal bodies b of  w . [ (r_b - c) x Q_r + E(p_b) Q_p / 2 ]

the moment about the joint axis w through the joint centre c of the generalised forces Q with which the group acts on
the bodies on the far side of the joint; equal to its virtual work for a unit rotation of those bodies.
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dms_core.model.constraints.joints.revolute import Revolute
from dms_core.model.element import COMPOSITIONS, MOMENT, DynamicElement, Placement, Sensor
from dms_core.model.geometry.frames import unit
from dms_core.model.places import numbers_at


class JointMoment(Sensor):
    """Moment [Nm] about a revolute joint with which `elements` act on the distal `bodies`."""

    kind: ClassVar[str] = "joint_moment"
    composition: ClassVar[int] = COMPOSITIONS.joint_moment
    joint: str = Field(description="revolute joint")
    elements: tuple[str, ...] = Field(min_length=1, description="muscles, ropes, springs, ... that are summed")
    bodies: tuple[str, ...] | None = Field(
        default=None, description="bodies on the far side of the joint; body_j of the joint when not given"
    )

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """One."""
        return (("", "Nm"),)

    def place(self, system) -> Placement:
        """Bodies: body_i of the joint, then the distal ones. Numbers: joint centre and axis on body_i."""
        joint = system.element(self.joint, Revolute)
        for name in self.elements:
            system.element(name, DynamicElement)
        distal = self.bodies if self.bodies is not None else (joint.body_j,)
        for name in distal:
            system.body(name)
        axis = unit(joint.axis_i, f"revolute '{joint.name}': axis_i")
        numbers = numbers_at(MOMENT, centre=system.arm(joint.body_i, joint.point_i), axis=axis)
        return Placement(
            bodies=(joint.body_i, *distal),
            numbers=numbers,
            sources=self.elements,
        )

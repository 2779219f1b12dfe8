"""The angle of a declared revolute joint, as a controller or a sensor refers to it."""

from __future__ import annotations

from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.element import Vector
from dms_core.model.geometry.angle import angle_frame


def sensed_angle(
    system, who: str, joint: str, pointer_i: Vector | None, pointer_j: Vector | None
) -> tuple[tuple[str, str], tuple[float, ...]]:
    """Bodies of the joint and the nine numbers f, g, h [-] of dms_core.model.geometry.angle that define its angle."""
    hinge = system.element(joint, AxisJoint)
    frame = angle_frame(system, who, hinge, pointer_i, pointer_j)
    return (hinge.body_i, hinge.body_j), tuple(float(x) for x in frame)

"""What joints about an axis have in common: two bodies, a point and an axis on each, and an angle about it."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.model.constraints.joints.relative_pose import joint_arms
from dms_core.model.element import GROUND, Constraint, Vector
from dms_core.model.geometry.frames import perpendicular, unit


class AxisNumbers(NamedTuple):
    """Places of the numbers of a joint about an axis."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    f_i: int = 6
    """Directions across the axis in the first body."""
    g_i: int = 9
    a_j: int = 12
    """The axis in the second body."""


AXIS = AxisNumbers()


class AxisJoint(Constraint):
    """Joint whose body_j may turn about axis_i of body_i, along which axis_j of body_j lies.

    What is not given of body_j is taken from the declared start poses.
    """

    own_points: ClassVar = (AXIS.s_i, AXIS.s_j)
    body_i: str = Field(default=GROUND, description="first body, or 'ground'")
    body_j: str = Field(description="second body")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="joint centre in the frame of body_i [m]")
    point_j: Vector | None = Field(default=None, description="joint centre in the frame of body_j [m]")
    axis_i: Vector = Field(default=(0.0, 0.0, 1.0), description="joint axis in the frame of body_i [-]; normalised")
    axis_j: Vector | None = Field(default=None, description="joint axis in the frame of body_j [-]; normalised")

    def aligned(self, numbers) -> tuple[np.ndarray, np.ndarray]:
        """Axis of body_i and that of body_j, which coincide, as rows, shapes (1, 3)."""
        f, g, a = (np.array(numbers[k : k + 3]) for k in (AXIS.f_i, AXIS.g_i, AXIS.a_j))
        return np.cross(f, g)[None], a[None]

    def axes(self, system) -> tuple[np.ndarray, np.ndarray]:
        """The axis in body_i and in body_j, unit vectors of shape (3,)."""
        axis_i = unit(self.axis_i, f"{self.kind} '{self.name}': axis_i")
        if self.axis_j is None:
            return axis_i, system.start_direction(self.body_i, axis_i, self.body_j)
        return axis_i, unit(self.axis_j, f"{self.kind} '{self.name}': axis_j")

    def axis_numbers(self, system) -> dict[str, np.ndarray]:
        """The numbers of AXIS by name."""
        axis_i, axis_j = self.axes(system)
        s_i, s_j = joint_arms(system, self)
        f = perpendicular(axis_i)
        return {"s_i": s_i, "s_j": s_j, "f_i": f, "g_i": np.cross(axis_i, f), "a_j": axis_j}

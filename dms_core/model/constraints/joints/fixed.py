"""Fixed joint (paper sect. 3.2): body_j keeps its pose relative to body_i. Six rows.

    r_i + A_i s_i - r_j - A_j s_j = 0                                             (3)
    (A_i x) . (A_j y') = 0,  (A_i y) . (A_j z') = 0,  (A_i z) . (A_j x') = 0      (3)

x, y, z are the axes of body i and x', y', z' those directions of body j that coincide with them.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.relative_pose import joint_arms, relative_rotation
from dms_core.model.constraints.primitives import coincidence, dot1, joint_pattern
from dms_core.model.element import GROUND, Constraint, Placement, Quaternion, Vector
from dms_core.model.geometry.rotations import AXES, vec
from dms_core.model.places import numbers_at


class WeldNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    axes: int = 6
    """Directions x', y', z' of the second body, nine numbers."""


WELD = WeldNumbers()


@compiled
def fixed(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    coincidence(0, 0, 7, vec(par, WELD.s_i), vec(par, WELD.s_j), q, v, lam, level, phi, G, W, H)
    for k in range(3):
        dot1(3 + k, 0, 7, AXES[k], vec(par, WELD.axes + 3 * ((k + 1) % 3)), 0.0, q, v, lam, level, phi, G, W, H)


class Fixed(Constraint):
    """Weld of body_j to body_i. What is not given is taken from the declared start poses."""

    kind: ClassVar[str] = "fixed"
    own_points: ClassVar = (WELD.s_i, WELD.s_j)
    kernel: ClassVar = fixed
    body_i: str = Field(default=GROUND, description="first body, or 'ground'")
    body_j: str = Field(description="second body")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="common point in the frame of body_i [m]")
    point_j: Vector | None = Field(default=None, description="common point in the frame of body_j [m]")
    orientation: Quaternion | None = Field(
        default=None, description="Euler parameters of body_j's axes in those of body_i, scalar first [-]; normalised"
    )

    def rows(self) -> tuple[str, ...]:
        """Coincidence in ground axes, then rotations about the axes z, x, y of body_i."""
        return ("x", "y", "z", "turn_z", "turn_x", "turn_y")

    def aligned(self, numbers) -> tuple[np.ndarray, np.ndarray]:
        """Axes of body_i and the directions of body_j that coincide with them, as rows, shapes (3, 3)."""
        return np.eye(3), np.reshape(numbers[WELD.axes : WELD.axes + 9], (3, 3))

    def welded(self) -> tuple[str, ...]:
        """Both bodies."""
        return (self.body_i, self.body_j)

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        R = relative_rotation(system, f"fixed '{self.name}'", self.body_i, self.body_j, self.orientation)
        # Row k of R is axis k of body_i, seen from body_j.
        s_i, s_j = joint_arms(system, self)
        numbers = numbers_at(WELD, s_i=s_i, s_j=s_j, axes=R)
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("ccc111"))

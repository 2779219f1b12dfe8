"""Slider, or prismatic joint (paper sect. 3.2): body_j moves along an axis of body_i without turning. Five rows.

    (A_i f) . d = 0,  (A_i g) . d = 0        d = r_j + A_j s_j - r_i - A_i s_i,  f, g perpendicular to the axis a   (2)
    (A_i f) . (A_j g') = 0,  (A_i g) . (A_j a') = 0,  (A_i a) . (A_j f') = 0                                       (3)

f', g', a' are the directions of body j that coincide with f, g, a.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.relative_pose import joint_arms, relative_rotation
from dms_core.model.constraints.primitives import dot1, dot2, joint_pattern
from dms_core.model.element import GROUND, Constraint, Placement, Quaternion, Vector
from dms_core.model.geometry.frames import perpendicular, unit
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at


class SliderNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    axes_i: int = 6
    """Directions f, g, a of the first body, nine numbers."""
    axes_j: int = 15
    """Directions f', g', a' of the second body, nine numbers."""


SLIDER = SliderNumbers()


@compiled
def slider(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    s_i, s_j = vec(par, SLIDER.s_i), vec(par, SLIDER.s_j)
    for k in range(2):
        dot2(k, 0, 7, vec(par, SLIDER.axes_i + 3 * k), s_i, s_j, q, v, lam, level, phi, G, W, H)
    for k in range(3):
        b = vec(par, SLIDER.axes_j + 3 * ((k + 1) % 3))
        dot1(2 + k, 0, 7, vec(par, SLIDER.axes_i + 3 * k), b, 0.0, q, v, lam, level, phi, G, W, H)


class Slider(Constraint):
    """Prismatic joint: point_j of body_j stays on the axis through point_i of body_i; the bodies do not turn.

    What is not given of body_j is taken from the declared start poses.
    """

    kind: ClassVar[str] = "slider"
    own_points: ClassVar = (SLIDER.s_i, SLIDER.s_j)
    kernel: ClassVar = slider
    body_i: str = Field(default=GROUND, description="body that carries the axis, or 'ground'")
    body_j: str = Field(description="body that slides")
    axis_i: Vector = Field(description="direction of sliding in the frame of body_i [-]; normalised")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="point of the axis in the frame of body_i [m]")
    point_j: Vector | None = Field(
        default=None,
        description="point of body_j that stays on the axis, in its frame [m]; default: where point_i starts",
    )
    orientation: Quaternion | None = Field(
        default=None, description="Euler parameters of body_j's axes in those of body_i, scalar first [-]; normalised"
    )

    def rows(self) -> tuple[str, ...]:
        """Distances from the axis along f and g, then rotations about a, f, g."""
        return ("off_f", "off_g", "turn_a", "turn_f", "turn_g")

    def aligned(self, numbers) -> tuple[np.ndarray, np.ndarray]:
        """Directions f, g, a of body_i and f', g', a' of body_j that coincide with them, as rows, shapes (3, 3)."""
        i, j = SLIDER.axes_i, SLIDER.axes_j
        return np.reshape(numbers[i : i + 9], (3, 3)), np.reshape(numbers[j : j + 9], (3, 3))

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        who = f"slider '{self.name}'"
        a = unit(self.axis_i, f"{who}: axis_i")
        f = perpendicular(a)
        frame = np.array([f, np.cross(a, f), a])
        R = relative_rotation(system, who, self.body_i, self.body_j, self.orientation)
        s_i, s_j = joint_arms(system, self)
        numbers = numbers_at(SLIDER, s_i=s_i, s_j=s_j, axes_i=frame, axes_j=frame @ R)
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("22111"))

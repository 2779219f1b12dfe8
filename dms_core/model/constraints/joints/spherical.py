"""Spherical joint (paper eq. 10): two bodies share a point. Three rows.

    r_i + A_i s_i - r_j - A_j s_j = 0

Its multipliers are the joint force in ground axes [N]: -lam acts on body_i, lam on body_j.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.relative_pose import joint_arms
from dms_core.model.constraints.primitives import coincidence, joint_pattern
from dms_core.model.element import GROUND, Constraint, Placement, Vector
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at


class BallNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3


BALL = BallNumbers()


@compiled
def spherical(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    coincidence(0, 0, 7, vec(par, BALL.s_i), vec(par, BALL.s_j), q, v, lam, level, phi, G, W, H)


class Spherical(Constraint):
    """Ball joint between body_i and body_j; point_j is taken from the declared start poses where it is not given."""

    kind: ClassVar[str] = "spherical"
    own_points: ClassVar = (BALL.s_i, BALL.s_j)
    kernel: ClassVar = spherical
    body_i: str = Field(default=GROUND, description="first body, or 'ground'")
    body_j: str = Field(description="second body")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="joint centre in the frame of body_i [m]")
    point_j: Vector | None = Field(default=None, description="joint centre in the frame of body_j [m]")

    def rows(self) -> tuple[str, ...]:
        """Coincidence in ground axes."""
        return ("x", "y", "z")

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        s_i, s_j = joint_arms(system, self)
        numbers = numbers_at(BALL, s_i=s_i, s_j=s_j)
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("ccc"))

"""Universal joint (Cardan, Hooke): two bodies share a point, and an axis of each stays across that of the other.

    r_i + A_i s_i - r_j - A_j s_j = 0        (3)
    (A_i a_i) . (A_j a_j) = 0                (1)

a_i and a_j are the arms of the cross: body_i turns against the cross about a_i, body_j about a_j. Between two shafts
whose axes enclose the angle beta, with the arms across their shafts, the angles of turn obey

    tan(theta_j) = cos(beta) tan(theta_i)

both counted from where a_i is across the plane of the shafts, which is the fourth row with a_i and a_j written out.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.constraints.joints.relative_pose import joint_arms
from dms_core.model.constraints.primitives import coincidence, dot1, joint_pattern
from dms_core.model.element import GROUND, Constraint, Placement, Vector
from dms_core.model.geometry.frames import unit
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at

LEAST_ACROSS = 1e-3
"""Length of an axis's part across the other [-] below which the two are along each other."""


class CrossNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    s_i: int = 0
    """Point on each body, from its centre of mass [m]."""
    s_j: int = 3
    a_i: int = 6
    """Arm of the cross in each body."""
    a_j: int = 9


CROSS = CrossNumbers()


@compiled
def universal(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equations and their derivatives."""
    coincidence(0, 0, 7, vec(par, CROSS.s_i), vec(par, CROSS.s_j), q, v, lam, level, phi, G, W, H)
    dot1(3, 0, 7, vec(par, CROSS.a_i), vec(par, CROSS.a_j), 0.0, q, v, lam, level, phi, G, W, H)


class Universal(Constraint):
    """Cross of two hinges whose axes meet at right angles: axis_i fixed in body_i, axis_j in body_j.

    point_j is taken from the declared start poses where it is not given.
    """

    kind: ClassVar[str] = "universal"
    own_points: ClassVar = (CROSS.s_i, CROSS.s_j)
    kernel: ClassVar = universal
    body_i: str = Field(default=GROUND, description="first body, or 'ground'")
    body_j: str = Field(description="second body")
    point_i: Vector = Field(default=(0.0, 0.0, 0.0), description="centre of the cross in the frame of body_i [m]")
    point_j: Vector | None = Field(default=None, description="centre of the cross in the frame of body_j [m]")
    axis_i: Vector = Field(description="arm of the cross that turns in body_i, in its frame [-]; normalised")
    axis_j: Vector = Field(
        description="arm of the cross that turns in body_j, in its frame [-]; across axis_i, and normalised"
    )

    def rows(self) -> tuple[str, ...]:
        """Coincidence in ground axes, then the angle between the arms."""
        return ("x", "y", "z", "across")

    def place(self, system) -> Placement:
        """Both bodies; points relative to their centres of mass."""
        who = f"universal '{self.name}'"
        a_i, a_j = unit(self.axis_i, f"{who}: axis_i"), unit(self.axis_j, f"{who}: axis_j")
        across = np.cross(system.start_direction(self.body_i, a_i, self.body_j), a_j)
        if np.linalg.norm(across) < LEAST_ACROSS:
            raise ModelError(
                f"{who}: axis_i = {self.axis_i} of '{self.body_i}' and axis_j = {self.axis_j} of '{self.body_j}' lie "
                "along each other at the start. Expected two arms of a cross, at right angles."
            )
        s_i, s_j = joint_arms(system, self)
        numbers = numbers_at(CROSS, s_i=s_i, s_j=s_j, a_i=a_i, a_j=a_j)
        return Placement(bodies=(self.body_i, self.body_j), numbers=numbers, pattern=joint_pattern("ccc1"))

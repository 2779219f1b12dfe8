"""Rope that is wound on a drum without slip: what the drum turns joins the free length of the rope. One row.

    l(q) - l(0) - s r (theta - theta(0)) = 0        s = 1 where a growing angle pays rope out, -1 where it takes it up

l is the length of the path from the drum to the rope's end. The path begins at the rim, where the rope leaves the drum:
a point that moves with the drum's axis and turns with the body that carries the drum, not with the drum itself. The
multiplier is the tension tau [N]: it pulls at both ends of the path, at the drum as a force through its axis and the
moment tau r. Two ropes on one drum, one paid out as the other is taken up, are a rope that runs over the drum without
slip.

The angle is known but for whole turns, and so is the row but for whole circumferences: the value nearest to 0 is right
after any number of turns.
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.constraints.joints.relative_pose import joint_arms
from dms_core.model.element import Constraint, ConstraintPattern, Limit, Placement
from dms_core.model.geometry.angle import (
    add_angle_gradient,
    add_angle_hessian,
    add_angle_rate_gradient,
    joint_angle,
    start_frame,
)
from dms_core.model.geometry.path import (
    PathPoint,
    add_path_gradient,
    add_path_hessian,
    add_path_rate_gradient,
    path_pattern,
    path_table,
    start_length,
)
from dms_core.model.geometry.rotations import vec
from dms_core.model.geometry.span import add_span_gradient, add_span_hessian, add_span_rate_gradient
from dms_core.model.ropes.pushing import no_push

SPAN_INTEGERS, SPAN_NUMBERS = 3, 11
"""Where the span from the rim begins: in `ip` behind the offsets of both bodies of the joint and the place of the rest
of the path, in `par` behind s r, the length at the start, and f, g, h of the angle."""
PARTS = 3
"""Most parts of that span: the drum's axis, the carrier's turn, the far end."""
PATH_NUMBERS = SPAN_NUMBERS + 3 * PARTS
"""Where the rest of the path begins in `par`."""
TOLD = 0.1
"""Lever of the rope about the drum's axis, over the radius, from which on it tells the sense of winding."""


@compiled
def drum_rope(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """The equation and its derivatives."""
    oi, oj, rest, radius, f, g, h = ip[0], ip[1], ip[2], par[0], vec(par, 2), vec(par, 5), vec(par, 8)
    error = add_span_gradient(ip, SPAN_INTEGERS, par, SPAN_NUMBERS, q, 1.0, G[0]) - par[1]
    error += add_path_gradient(ip, rest, par, PATH_NUMBERS, q, 1.0, G[0])
    error -= radius * joint_angle(oi, oj, f, g, h, q)
    circumference = 2.0 * math.pi * abs(radius)
    phi[0] = error - circumference * math.floor(error / circumference + 0.5)
    add_angle_gradient(0, oi, oj, f, g, h, q, -radius, G)
    if level > 0:
        add_span_rate_gradient(ip, SPAN_INTEGERS, par, SPAN_NUMBERS, q, v, 1.0, W[0])
        add_path_rate_gradient(ip, rest, par, PATH_NUMBERS, q, v, 1.0, W[0])
        add_angle_rate_gradient(0, oi, oj, f, g, h, q, v, -radius, W)
        add_span_hessian(ip, SPAN_INTEGERS, par, SPAN_NUMBERS, q, lam[0], H)
        add_path_hessian(ip, rest, par, PATH_NUMBERS, q, lam[0], H)
        add_angle_hessian(oi, oj, f, g, h, q, -radius * lam[0], H)


class DrumRope(Constraint):
    """Massless, inextensible rope from a drum to the end of a path, taut at the declared start."""

    kind: ClassVar[str] = "drum_rope"
    kernel: ClassVar = drum_rope
    joint: str = Field(description="joint in which the drum, its body_j, turns")
    radius: float = Field(gt=0.0, description="radius of the drum [m]")
    path: tuple[PathPoint, ...] = Field(
        min_length=2, description="points from where the rope leaves the drum, on body_i of the joint, to its end"
    )
    winding: Literal["pays_out", "takes_up"] | None = Field(
        default=None,
        description="what a growing angle of the joint does; default: told by the side on which the rope leaves",
    )

    def rows(self) -> tuple[str, ...]:
        """One."""
        return ("length",)

    def limits(self) -> tuple[Limit, ...]:
        """A rope cannot push."""
        return no_push(
            "multiplier", f"{self.name}.length", "its tension was negative, where a real rope would be slack"
        )

    def place(self, system) -> Placement:
        """Bodies of the path, then those of the joint that are not among them."""
        joint = system.element(self.joint, AxisJoint)
        if self.path[0].body != joint.body_i:
            raise ModelError(
                f"drum_rope '{self.name}': path begins on '{self.path[0].body}'. Expected a point of '{joint.body_i}', "
                f"which carries the drum '{joint.body_j}': where the rope leaves the drum does not turn with it."
            )
        if all(p.body == joint.body_i for p in self.path):
            raise ModelError(
                f"drum_rope '{self.name}': all points of the path are on '{joint.body_i}', which carries the drum, so "
                "that its length never changes. Let it end on another body."
            )
        rest = path_table(system, self.path[1:])
        bodies = tuple(dict.fromkeys((*rest.bodies, joint.body_i, joint.body_j, self.path[1].body)))
        oi, oj = 7 * bodies.index(joint.body_i), 7 * bodies.index(joint.body_j)
        parts = self._span(system, joint)
        span = [len(parts), *(x for body, t, n, _ in parts for x in (7 * bodies.index(body), t, n))]
        arms = np.ravel([s for *_, s in parts])
        numbers = (self._sense(system, joint) * self.radius, start_length(system, self.path))
        return Placement(
            bodies=bodies,
            integers=(oi, oj, SPAN_INTEGERS + len(span), *span, *rest.integers),
            numbers=(
                *numbers, *map(float, start_frame(system, joint)), *map(float, arms), *rest.numbers
            ),
            pattern=_pattern(rest, 7 * len(bodies), [7 * bodies.index(body) for body, *_ in parts]),
        )  # fmt: skip

    def _span(self, system, joint: AxisJoint) -> list[tuple[str, int, int, np.ndarray]]:
        """Parts of the vector from the rim to the path's second point: body, t, n and s of span.py."""
        second = self.path[1]
        axis_j = joint_arms(system, joint)[1]
        rim = np.asarray(self.path[0].point) - np.asarray(joint.point_i)
        return [
            (joint.body_j, 1, -1, axis_j),
            (joint.body_i, 0, -1, rim),
            (second.body, 1, 1, system.arm(second.body, second.point)),
        ]

    def _sense(self, system, joint: AxisJoint) -> float:
        """1 where a growing angle pays rope out: where the rim, at the path's first point, moves along the rope.

        Raises:
            ModelError: the declared winding contradicts the path, or neither tells it.
        """
        first, second = self.path[:2]
        along = system.start_point(second.body, second.point, joint.body_i) - np.asarray(first.point)
        rim = np.cross(joint.axes(system)[0], np.asarray(first.point) - np.asarray(joint.point_i))
        lever = float(rim @ along) / max(float(np.linalg.norm(along)), 1e-12)
        told = None if abs(lever) < TOLD * self.radius else "pays_out" if lever > 0.0 else "takes_up"
        if told is None and self.winding is None:
            raise ModelError(
                f"drum_rope '{self.name}': the rope's line passes the axis of '{joint.name}' at {abs(lever):.3g} m, "
                f"which does not tell how it is wound on a drum of radius {self.radius:g} m. Expected a first point "
                "at the rim, or winding = 'pays_out' or 'takes_up'."
            )
        if None not in (told, self.winding) and told != self.winding:
            raise ModelError(
                f"drum_rope '{self.name}': winding = '{self.winding}', but the drum is wound the other way: where the "
                f"rope leaves it, at {tuple(first.point)} of '{joint.body_i}', a growing angle of '{joint.name}' moves "
                f"the rim {'along' if lever > 0.0 else 'against'} the rope. Expected winding = '{told}', or a first "
                "point on the other side of the axis."
            )
        return 1.0 if (told or self.winding) == "pays_out" else -1.0


def _pattern(rest, n: int, offsets: list[int]) -> ConstraintPattern:
    """The bodies of the span from the rim, and those of the rest of the path."""
    row, H = np.zeros((1, n), bool), path_pattern(rest, n)
    near = np.concatenate([np.arange(o, o + 7) for o in dict.fromkeys(offsets)])
    row[0, : rest.size] = True
    row[0, near] = True
    H[np.ix_(near, near)] = True
    return ConstraintPattern(row, row, H)

"""A linear relation between joint coordinates: what gears, racks, belts and couplings are made of. One row.

    sum_k c_k (x_k - x_k(0)) = 0

x_k is the angle [rad] of a joint about an axis, or its way along the axis [m]; x_k(0) that of the declared start.

An angle is known from the bodies' poses but for whole turns. Where one angle alone is coupled the relation is known but
for multiples of 2 pi c, and the value nearest to 0 is right after any number of turns. With several angles the one of
the largest |c| is treated so; for each other a turn counter, which comes with the relation, tells the whole turns.

Its multiplier lam is the load of the relation: -lam c_k is the moment [N m] or force [N] that drives x_k.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.constraints.joints.cylindrical import Cylindrical
from dms_core.model.constraints.joints.relative_pose import joint_arms
from dms_core.model.constraints.joints.screw import Screw
from dms_core.model.constraints.joints.slider import Slider
from dms_core.model.constraints.primitives import dot2, joint_pattern
from dms_core.model.element import Constraint, ConstraintPattern, DynamicElement, Placement
from dms_core.model.forces.joint.turn_counter import TurnCounter, whole_turns
from dms_core.model.geometry.angle import (
    add_angle_gradient,
    add_angle_hessian,
    add_angle_rate_gradient,
    joint_angle,
    start_frame,
)
from dms_core.model.geometry.frames import unit
from dms_core.model.geometry.rotations import scale, vec

ANGLE, SLIDE = 0, 1
"""What a term is: second integer of it."""
TERM_INTEGERS, TERM_NUMBERS = 4, 11
"""Length of a term in `ip`: (kind, offsets of both bodies, turn counter or -1), behind the number of terms; and in
`par`: (c, start, f, g, h) of an angle or (c, start, axis, s_i, s_j) of a way, behind the period of the sum."""


@compiled
def _add_angle(k, ip, par, q, v, lam, level, G, W, H):
    """Gradient and derivatives of term k, an angle; gives c (x - x(0))."""
    i, p = 1 + TERM_INTEGERS * k, 1 + TERM_NUMBERS * k
    oi, oj, counter, c = ip[i + 1], ip[i + 2], ip[i + 3], par[p]
    f, g, h = vec(par, p + 2), vec(par, p + 5), vec(par, p + 8)
    angle = joint_angle(oi, oj, f, g, h, q)
    if counter >= 0:
        angle += whole_turns(q[counter], angle)
    add_angle_gradient(0, oi, oj, f, g, h, q, c, G)
    if level > 0:
        add_angle_rate_gradient(0, oi, oj, f, g, h, q, v, c, W)
        add_angle_hessian(oi, oj, f, g, h, q, c * lam[0], H)
    return c * angle


@compiled
def relation(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """ip: number of terms, then TERM_INTEGERS each. par: period of the sum or 0, then TERM_NUMBERS each."""
    total = 0.0
    for k in range(ip[0]):
        i, p = 1 + TERM_INTEGERS * k, 1 + TERM_NUMBERS * k
        if ip[i] == ANGLE:
            total += _add_angle(k, ip, par, q, v, lam, level, G, W, H)
        else:
            axis, s_i, s_j = scale(par[p], vec(par, p + 2)), vec(par, p + 5), vec(par, p + 8)
            dot2(0, ip[i + 1], ip[i + 2], axis, s_i, s_j, q, v, lam, level, phi, G, W, H)
            total += phi[0] - par[p] * par[p + 1]
    if par[0] > 0.0:
        total -= par[0] * math.floor(total / par[0] + 0.5)
    phi[0] = total


class Term(NamedTuple):
    """One joint coordinate of a relation, times a factor."""

    joint: str
    coordinate: Literal["angle", "slide"]
    factor: float

    def __str__(self) -> str:
        return f"the {self.coordinate} of '{self.joint}'"


class Relation(Constraint):
    """Base of everything that couples joint coordinates by a linear relation."""

    kernel: ClassVar = relation

    def terms(self) -> tuple[Term, ...]:
        """The coupled coordinates; no factor is 0, and no coordinate stands there twice."""
        raise NotImplementedError

    def rows(self) -> tuple[str, ...]:
        """The relation, in the unit of its sum."""
        return ("relation",)

    def governs(self) -> str:
        """Two coordinates can be coupled once; among more there may be several relations."""
        terms = self.terms()
        return f"how {' and '.join(sorted(map(str, terms)))} go together" if len(terms) == 2 else ""

    def _counted(self) -> dict[str, str]:
        """Name of the turn counter of each angle that needs one, by its joint."""
        angles = sorted((t for t in self.terms() if t.coordinate == "angle"), key=lambda t: -abs(t.factor))
        return {t.joint: f"{self.name}.turns.{t.joint}" for t in angles[1:]}

    def companions(self) -> tuple[DynamicElement, ...]:
        """A turn counter for each angle but that of the largest factor."""
        return tuple(TurnCounter(name=name, joint=joint) for joint, name in self._counted().items())

    def place(self, system) -> Placement:
        """The bodies of all joints, then the turn counters."""
        terms, counters = self.terms(), self._counted()
        joints = [_joint(system, term) for term in terms]
        bodies = tuple(dict.fromkeys(b for joint in joints for b in (joint.body_i, joint.body_j)))
        local = {joint: 7 * len(bodies) + k for k, joint in enumerate(counters)}
        largest = max((abs(t.factor) for t in terms if t.coordinate == "angle"), default=0.0)
        integers, numbers = [len(terms)], [2.0 * math.pi * largest]
        for term, joint in zip(terms, joints, strict=True):
            where = (7 * bodies.index(joint.body_i), 7 * bodies.index(joint.body_j))
            kind = ANGLE if term.coordinate == "angle" else SLIDE
            integers += [kind, *where, local.get(term.joint, -1) if kind == ANGLE else -1]
            numbers += [term.factor, *map(float, _numbers(system, self, term, joint))]
        return Placement(
            bodies=bodies,
            coordinates=tuple(f"{name}.angle" for name in counters.values()),
            integers=tuple(integers),
            numbers=tuple(numbers),
            pattern=_pattern(7 * len(bodies) + len(counters), integers),
        )


def _joint(system, term: Term) -> Any:
    """The joint of a term; one that has no such coordinate is an error that lists the right ones."""
    return system.element(term.joint, AxisJoint if term.coordinate == "angle" else (Cylindrical, Screw, Slider))


def _numbers(system, relation: Relation, term: Term, joint) -> np.ndarray:
    """Start and geometry of a term, shape (10,)."""
    if term.coordinate == "angle":
        return np.concatenate([[0.0], start_frame(system, joint)])
    axis, (s_i, s_j) = unit(joint.axis_i, f"{joint.kind} '{joint.name}': axis_i"), joint_arms(system, joint)
    # Both points seen from the reference frame of body_i at the declared start.
    from_j = s_j - system.arm(joint.body_j, (0.0, 0.0, 0.0))
    from_i = s_i - system.arm(joint.body_i, (0.0, 0.0, 0.0))
    way = system.start_point(joint.body_j, from_j, joint.body_i) - from_i
    return np.concatenate([[axis @ way], axis, s_i, s_j])


def _pattern(n: int, integers: list[int]) -> ConstraintPattern:
    """Pattern of the sum of all terms; what a turn counter says is constant between turns."""
    G, W, H = np.zeros((1, n), bool), np.zeros((1, n), bool), np.zeros((n, n), bool)
    for kind, oi, oj, _ in np.reshape(integers[1:], (-1, TERM_INTEGERS)):
        own = joint_pattern("1" if kind == ANGLE else "2")
        at = np.r_[oi : oi + 7, oj : oj + 7]
        G[:, at] |= own.G
        W[:, at] |= own.W
        H[np.ix_(at, at)] |= own.H
    return ConstraintPattern(G, W, H)

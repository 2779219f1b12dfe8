"""Torsion spring about a joint with a curve of its own, wound by any number of turns, and a damper.

    M = curve(theta - theta0) + c thetadot,   Q = -M theta_q^T

theta counts whole turns: it is the joint's angle at the declared start and goes on from there. The spring keeps the
turns in a state of its own (see `TurnCounter`), the moment is that of the angle itself. Without damping the energy
E + integral of the curve up to theta - theta0 is constant.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.element import Pattern, Placement, Vector
from dms_core.model.forces.joint.joint_moment import put_joint_moment
from dms_core.model.forces.joint.turn_counter import CountsTurns, add_turn_row, counter_pattern, whole_turns
from dms_core.model.forces.load_curve import LoadCurve, curve_load, stiffness_numbers
from dms_core.model.geometry.angle import angle_frame, angle_rate, joint_angle, start_angle, start_frame
from dms_core.model.geometry.rotations import vec
from dms_core.model.places import numbers_at


class TorsionNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    f: int = 0
    """Frame of the angle since the start, see dms_core.model.geometry.angle."""
    g: int = 3
    h: int = 6
    start: int = 9
    """Twist at the declared start [rad]."""
    damping: int = 10
    curve: int = 11


TORSION = TorsionNumbers()


@compiled
def torsion_spring(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """Row terms M theta_q^T, then the row of the counted angle."""
    f, g, h = vec(par, TORSION.f), vec(par, TORSION.g), vec(par, TORSION.h)
    angle = joint_angle(0, 7, f, g, h, q)
    angle += whole_turns(q[14], angle)
    load, stiffness = curve_load(par, TORSION.curve, par[TORSION.start] + angle)
    c = par[TORSION.damping]
    M = load + c * angle_rate(0, 7, f, g, h, q, v)
    put_joint_moment(f, g, h, q, v, M, stiffness, c, level, r, Jq, Jv)
    add_turn_row(14, f, g, h, q, v, level, r, Jq, Jv)


class TorsionSpring(CountsTurns):
    """Torsion spring that may be wound by many turns, with a stiffness or a curve, and a damper.

    The angle is that of the joint where the declared start is, and counts whole turns from there. '<name>.angle' is the
    turn since the start [rad].
    """

    kind: ClassVar[str] = "torsion_spring"
    kernel: ClassVar = torsion_spring
    stiffness: float | None = Field(default=None, gt=0.0, description="k [N m/rad]; or give a curve")
    curve: LoadCurve | None = Field(default=None, description="moment [N m] against the twist theta - theta0 [rad]")
    damping: float = Field(default=0.0, ge=0.0, description="c [N m s/rad]")
    rest_angle: float = Field(
        default=0.0, description="theta0, of which the twist counts [rad]; by turns where the spring is wound already"
    )
    pointer_i: Vector | None = Field(default=None, description="direction in body_i [-]; default: any, see angle_frame")
    pointer_j: Vector | None = Field(default=None, description="direction in body_j that lies along it at angle 0 [-]")

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        if (self.stiffness is None) == (self.curve is None):
            given = "neither a stiffness nor a curve" if self.curve is None else "both a stiffness and a curve"
            raise ValueError(f"{given}; expected one of them")
        return self

    def place(self, system) -> Placement:
        """Both bodies of the joint, and the own coordinate."""
        joint = system.element(self.joint, AxisJoint)
        absolute = angle_frame(system, f"torsion_spring '{self.name}'", joint, self.pointer_i, self.pointer_j)
        frame = start_frame(system, joint)
        law = stiffness_numbers(self.stiffness) if self.curve is None else self.curve.table()  # type: ignore[arg-type]
        p, row = np.append(np.arange(14) % 7 >= 3, False), counter_pattern()
        full, none = np.outer(p, p), np.zeros((15, 15), bool)
        return Placement(
            bodies=(joint.body_i, joint.body_j),
            coordinates=(f"{self.name}.angle",),
            numbers=numbers_at(
                TORSION,
                f=frame[:3],
                g=frame[3:6],
                h=frame[6:],
                start=start_angle(system, joint, absolute) - self.rest_angle,
                damping=self.damping,
                curve=law,
            ),  # fmt: skip
            pattern=Pattern(full | row, (full if self.damping > 0.0 else none) | row, none),
        )

"""A device on an arm: upper link fixed to the humerus, hinge, guide to the forearm, controller, motors and ropes."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import Field, field_validator

from dms_core.model import (
    Fixed,
    JointSpringDamper,
    LineGuide,
    PathPoint,
    Pid,
    PlaneGuide,
    Revolute,
    RigidBody,
    RopeActuator,
    RopeForce,
    Slider,
)
from dms_core.model.element import Constraint, Force, Vector
from dms_core.model.geometry.frames import euler_parameters, quaternion, quaternion_product, rotation_matrix
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.cuff import Cuff
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.settings import Settings

UPPER, LOWER, HINGE, GUIDE, PID = "upper_link", "lower_link", "exo_hinge", "guide", "pid"
GuideKind = Literal["plane", "line", "slider"]
MOST_SHIFT, MOST_TILT = 0.1, 30.0
"""Largest component of a shift [m] and largest tilt [deg]: beyond, a device is not worn askew but off the arm."""


class Misalignment(Settings):
    """How the device is worn: hinge against elbow, in the axes of the links."""

    shift: Vector = Field(default=(0.0, 0.0, 0.0), description="of the hinge from the elbow centre [m]")
    tilt_deg: tuple[float, float] = Field(default=(0.0, 0.0), description="of the hinge axis about x, then y [deg]")

    @field_validator("shift")
    @classmethod
    def _on_the_arm(cls, shift: Vector) -> Vector:
        if max(map(abs, shift)) > MOST_SHIFT:
            raise ValueError(f"expected each component from -{MOST_SHIFT} to {MOST_SHIFT} m")
        return shift

    @field_validator("tilt_deg")
    @classmethod
    def _across_the_arm(cls, tilt: tuple[float, float]) -> tuple[float, float]:
        if max(map(abs, tilt)) > MOST_TILT:
            raise ValueError(f"expected both tilts from -{MOST_TILT:g} to {MOST_TILT:g} deg")
        return tilt


def motor_name(rope: str) -> str:
    """Name of the motor that pulls a rope."""
    return f"{rope}_motor"


def link_axes(arm: Arm) -> np.ndarray:
    """Axes x, y, z of an aligned link where the elbow is straight, as columns in ground axes, shape (3, 3)."""
    z = arm.axis
    y = np.array([0.0, 1.0, 0.0]) - z[1] * z
    y /= np.linalg.norm(y)
    return np.column_stack([np.cross(y, z), y, z])


class WornExoskeleton:
    """A device on an arm: its bodies, constraints and forces.

    Args:
        device: the exoskeleton.
        arm: arm whose humerus carries it.
        misalignment: how the device is worn.
        guide: 'plane' (one row), 'line' (two) or 'slider' (five).
        cuff: compliant cuff in place of the guide; None: none.
    """

    def __init__(
        self,
        device: Exoskeleton,
        arm: Arm,
        misalignment: Misalignment,
        guide: GuideKind = "plane",
        cuff: Cuff | None = None,
    ) -> None:
        self.device, self.arm, self.guide_kind, self.cuff = device, arm, guide, cuff
        axes = link_axes(arm)
        about_x, about_y = (math.radians(x) for x in misalignment.tilt_deg)
        tilt = quaternion_product(quaternion((1, 0, 0), about_x), quaternion((0, 1, 0), about_y))
        self.aligned = misalignment == Misalignment()
        """Whether the hinge axis is that of the elbow."""
        self.axes = axes
        self.shift = axes @ np.array(misalignment.shift)
        """Vector from the elbow centre to the hinge, in ground axes [m]."""
        self.orientation = quaternion_product(euler_parameters(axes), tilt)
        self.origin = arm.elbow + self.shift

    @property
    def frame(self) -> np.ndarray:
        """Axes of both links where the hinge is at 0, as columns in ground axes, shape (3, 3)."""
        return self.axes if self.aligned else rotation_matrix(self.orientation)

    @property
    def guided_point(self) -> np.ndarray:
        """Point of the forearm's long axis that the guide leads, in the forearm's frame [m]."""
        return self.axes @ (0.0, -self.device.guide_distance, 0.0)

    def hinge_angle(self, flexion: float) -> float:
        """Hinge angle at which the guide is closed where the elbow is at `flexion` [rad]; the same in a device aligned.

        The guided point of the forearm lies in the plane that the hinge axis and the y axis of the lower link span.
        """
        if self.aligned:
            return flexion
        x, y, _ = self.frame.T @ (self.arm.rotation(flexion) @ self.guided_point - self.shift)
        return math.atan2(x, -y)

    def bodies(self, flexion: float) -> list[RigidBody]:
        """Both links where the elbow is at `flexion` [rad], at rest."""
        turned = quaternion_product(self.orientation, quaternion((0, 0, 1), self.hinge_angle(flexion)))
        return [
            RigidBody(name=name, **dict(link), position=tuple(self.origin), orientation=tuple(p))
            for name, link, p in (
                (UPPER, self.device.upper_link, self.orientation),
                (LOWER, self.device.lower_link, turned),
            )
        ]

    def joints(self) -> list[Constraint]:
        """Upper link fixed to the humerus, hinge, and the guide where there is no compliant cuff."""
        on_humerus = tuple(self.origin - self.arm.segments["humerus"].origin)
        return [
            Fixed(name="cuff", body_i="humerus", body_j=UPPER, point_i=on_humerus),
            Revolute(name=HINGE, body_i=UPPER, body_j=LOWER, point_j=(0.0, 0.0, 0.0), axis_j=(0.0, 0.0, 1.0)),
            *([] if self.cuff else [self._guide()]),
        ]

    def cushions(self) -> list[Force]:
        """The compliant cuff, under the name of the guide that it replaces; none where the guide is rigid."""
        if self.cuff is None:
            return []
        at, orientation = (0.0, -self.device.guide_distance, 0.0), euler_parameters(self.axes)
        return [self.cuff.bushing(GUIDE, LOWER, at, "forearm", self.guided_point, orientation)]

    def _guide(self) -> Constraint:
        """Lower link and a point of the forearm on its long axis, seen across the elbow axis."""
        at = (0.0, -self.device.guide_distance, 0.0)
        if self.guide_kind == "plane":
            across, point = (1.0, 0.0, 0.0), tuple(self.guided_point)
            return PlaneGuide(name=GUIDE, body_i=LOWER, body_j="forearm", normal_i=across, point_i=at, point_j=point)
        kind = LineGuide if self.guide_kind == "line" else Slider
        return kind(name=GUIDE, body_i=LOWER, body_j="forearm", axis_i=(0.0, 1.0, 0.0), point_i=at)

    def forces(
        self, reference: str, authority: str, offset: str | None = None, *, start_tension: float | None = None
    ) -> list[Force]:
        """Hinge friction, controller, motors and ropes.

        Args:
            reference: name of the input psi(t) [rad].
            authority: name of the input that scales the controller's command, 0 to 1 [-].
            offset: coordinate added to the reference [rad], such as a filtered setpoint.
            start_tension: tension of the lifting rope [N]; None: that of a command without error.
        """
        d = self.device
        forces: list[Force] = [
            JointSpringDamper(name="hinge_friction", joint=HINGE, damping=d.hinge_damping),
            Pid(name=PID, joint=HINGE, reference=reference, offset=offset, drift_gain=d.drift_gain, **dict(d.gains)),
        ]
        for name, rope in d.ropes.items():
            motor = RopeActuator(
                name=motor_name(name), pid=PID, sign=rope.sign, authority=authority,
                start_tension=start_tension if name == d.lifting_rope else None, **dict(d.actuator),
            )  # fmt: skip
            path = (PathPoint(body=UPPER, point=rope.upper), PathPoint(body=LOWER, point=rope.lower))
            forces += [motor, RopeForce(name=name, path=path, coordinate=f"{motor.name}.tension")]
        return forces

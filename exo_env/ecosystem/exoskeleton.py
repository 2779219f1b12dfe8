"""The exoskeleton (paper sect. 4.1): upper link fixed to the humerus, lower link on a hinge at the elbow, two ropes.

The lower link leads the forearm through a guide. Its default is one row: a point of the forearm's long axis stays in
the plane of the lower link that holds the hinge axis. The guide then carries one force, the loop humerus - forearm -
lower link - upper link keeps full rank, and a device worn a few millimetres and degrees off still moves, since the
point slides in the plane. With a line or a slider instead, rows are redundant and only an aligned device moves.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import Field

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
from dms_core.model.geometry.frames import quaternion, quaternion_product
from dms_core.model.geometry.rotations import dot, sub
from exo_env.ecosystem.arm import Arm
from exo_env.jit import compiled
from exo_env.settings import Settings

UPPER, LOWER, HINGE, GUIDE, PID = "upper_link", "lower_link", "exo_hinge", "guide", "pid"
RopeName = Literal["agonist", "antagonist"]
AGONIST: RopeName = "agonist"
ANTAGONIST: RopeName = "antagonist"
GuideKind = Literal["plane", "line", "slider"]


class Link(Settings):
    """Inertia of a link in its own frame."""

    mass: float = Field(gt=0.0, description="mass [kg]")
    centre_of_mass: Vector = Field(description="[m]")
    inertia: Vector = Field(description="principal moments about the centre of mass [kg m^2]")

    def numbers(self) -> np.ndarray:
        """Mass [kg] and centre of mass [m], shape (4,)."""
        return np.array([self.mass, *self.centre_of_mass])


class Rope(Settings):
    """Both ends of a rope."""

    upper: Vector = Field(description="on the upper link [m]")
    lower: Vector = Field(description="on the lower link [m]")


class Actuator(Settings):
    """Motor of a rope."""

    time_constant: float = Field(gt=0.0, description="first-order lag of the tension [s]")
    max_tension: float = Field(gt=0.0, description="largest tension [N]")
    pretension: float = Field(ge=0.0, description="tension without a command [N]")
    width: float = Field(gt=0.0, description="width of the smoothed positive part [N]")


class PidGains(Settings):
    """Gains of both rope controllers, on the error in rad."""

    kp: float = Field(ge=0.0, description="[N/rad]")
    ki: float = Field(ge=0.0, description="[N/(rad s)]")
    kd: float = Field(ge=0.0, description="[N s/rad]")


class CriticalOscillation(Settings):
    """What the gains follow from; documentation and Fig. 6, no part of the model."""

    Kc: float = Field(gt=0.0, description="critical gain [N/rad]")
    Tc: float = Field(gt=0.0, description="critical period [s]")


class Misalignment(Settings):
    """How the device is worn: hinge against elbow, in the axes of the links."""

    shift: Vector = Field(default=(0.0, 0.0, 0.0), description="of the hinge from the elbow centre [m]")
    tilt_deg: tuple[float, float] = Field(default=(0.0, 0.0), description="of the hinge axis about x, then y [deg]")


class Exoskeleton(Settings):
    """A device, as in configs/exoskeletons."""

    upper_link: Link
    lower_link: Link
    hinge_damping: float = Field(ge=0.0, description="viscous friction [N m s/rad]")
    agonist: Rope
    antagonist: Rope
    guide_distance: float = Field(gt=0.0, description="from the hinge to the guided point of the forearm [m]")
    actuator: Actuator
    tuning: CriticalOscillation
    gains: PidGains
    drift_gain: float = Field(ge=0.0, description="feedback of the error coordinate's drift [1/s]")

    def moment_arm(self, rope: RopeName, angle: float) -> float:
        """-dl/dtheta of a rope at a hinge angle [rad]; positive where its tension flexes [m]."""
        ends: Rope = getattr(self, rope)
        return rope_lever(np.array(ends.upper), np.array(ends.lower), angle)

    def own_moment(self, angle: float, gravity: float) -> float:
        """Moment that holds the lower link at a hinge angle [rad] [Nm]; gravity in m/s^2."""
        return link_moment(self.lower_link.numbers(), angle, gravity)


@compiled
def rope_lever(upper, lower, angle):
    """-dl/dtheta of a rope from a point of the upper link to one of the lower, at a hinge angle [rad] [m]."""
    c, s = math.cos(angle), math.sin(angle)
    end = (c * lower[0] - s * lower[1], s * lower[0] + c * lower[1], lower[2])
    d = sub(end, (upper[0], upper[1], upper[2]))
    return (d[0] * end[1] - d[1] * end[0]) / math.sqrt(dot(d, d))


@compiled
def link_moment(link, angle, gravity):
    """Moment that holds the lower link at a hinge angle [rad] [Nm]; link: mass and centre of mass, shape (4,)."""
    return link[0] * gravity * (link[1] * math.cos(angle) - link[2] * math.sin(angle))


def link_axes(arm: Arm) -> np.ndarray:
    """Axes x, y, z of an aligned link where the elbow is straight, as columns in ground axes, shape (3, 3)."""
    z = arm.axis
    y = np.array([0.0, 1.0, 0.0]) - z[1] * z
    y /= np.linalg.norm(y)
    return np.column_stack([np.cross(y, z), y, z])


def _orientation(axes: np.ndarray) -> np.ndarray:
    """Euler parameters of a rotation matrix near the identity."""
    p0 = 0.5 * np.sqrt(1.0 + np.trace(axes))
    e = np.array([axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]]) / (4.0 * p0)
    return np.concatenate([[p0], e])


class WornExoskeleton:
    """A device on an arm: its bodies, constraints and forces.

    Args:
        device: the exoskeleton.
        arm: whose humerus carries it.
        misalignment: how it sits.
        guide: 'plane' (one row), 'line' (two) or 'slider' (five).
    """

    def __init__(self, device: Exoskeleton, arm: Arm, misalignment: Misalignment, guide: GuideKind = "plane") -> None:
        self.device, self.arm, self.guide_kind = device, arm, guide
        axes = link_axes(arm)
        about_x, about_y = (math.radians(x) for x in misalignment.tilt_deg)
        tilt = quaternion_product(quaternion((1, 0, 0), about_x), quaternion((0, 1, 0), about_y))
        self.axes = axes
        self.orientation = quaternion_product(_orientation(axes), tilt)
        self.origin = arm.elbow + axes @ np.array(misalignment.shift)

    def bodies(self, flexion: float) -> list[RigidBody]:
        """Both links with the hinge at `flexion` [rad], at rest."""
        turned = quaternion_product(self.orientation, quaternion((0, 0, 1), flexion))
        return [
            RigidBody(name=name, **dict(link), position=tuple(self.origin), orientation=tuple(p))
            for name, link, p in (
                (UPPER, self.device.upper_link, self.orientation),
                (LOWER, self.device.lower_link, turned),
            )
        ]

    def joints(self) -> list[Constraint]:
        """Upper link fixed to the humerus, hinge, guide."""
        on_humerus = tuple(self.origin - self.arm.segments["humerus"].origin)
        return [
            Fixed(name="cuff", body_i="humerus", body_j=UPPER, point_i=on_humerus),
            Revolute(name=HINGE, body_i=UPPER, body_j=LOWER, point_j=(0.0, 0.0, 0.0), axis_j=(0.0, 0.0, 1.0)),
            self._guide(),
        ]

    def _guide(self) -> Constraint:
        """Lower link and a point of the forearm on its long axis, seen across the elbow axis."""
        at = (0.0, -self.device.guide_distance, 0.0)
        if self.guide_kind == "plane":
            across, point = (1.0, 0.0, 0.0), tuple(self.axes @ at)
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
            start_tension: of the agonist [N]; None: that of a command without error.
        """
        d = self.device
        forces: list[Force] = [
            JointSpringDamper(name="hinge_friction", joint=HINGE, damping=d.hinge_damping),
            Pid(name=PID, joint=HINGE, reference=reference, offset=offset, drift_gain=d.drift_gain, **dict(d.gains)),
        ]
        sides: tuple[tuple[RopeName, Literal[1, -1], float | None], ...] = (
            (AGONIST, 1, start_tension),
            (ANTAGONIST, -1, None),
        )
        for name, sign, start in sides:
            rope: Rope = getattr(d, name)
            motor = RopeActuator(
                name=f"{name}_motor", pid=PID, sign=sign, authority=authority, start_tension=start, **dict(d.actuator)
            )
            path = (PathPoint(body=UPPER, point=rope.upper), PathPoint(body=LOWER, point=rope.lower))
            forces += [motor, RopeForce(name=name, path=path, coordinate=f"{motor.name}.tension")]
        return forces

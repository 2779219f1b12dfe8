"""The elbow as a device knows it: a forearm of average size, its own lower link, and what it does not know as inputs.

    forearm      I_f theta'' = net - grip + F d        F the guide's force, d its distance from the elbow
    lower link   I_l theta'' = grip - F d

`net` moves both; `grip` is what the device's ropes, weight and friction put on the lower link, and what all others put
against it on the forearm. So the moment that everything but the device puts on the elbow is

    others = net - grip = I_f theta'' - F d

Written like this, a device that lets go of an arm at rest changes one input and not two: net stays small, and grip is
told by the cuff's force sensor at once. No moment arm of a rope is needed. The body is that of a person of average
size, whoever wears the device. Upper arm and upper link stand still, so that they are part of the ground.
"""

from __future__ import annotations

from pydantic import Field

from dms_core.model import (
    Constant,
    Imu,
    Input,
    JointAngle,
    JointReaction,
    LumpedLoad,
    PlaneGuide,
    Revolute,
    System,
)
from dms_core.model.element import Constraint
from exo_env.ecosystem.arm import ELBOW, Arm
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.person import Person
from exo_env.ecosystem.sensors import FOREARM_IMU, WRIST
from exo_env.ecosystem.worn_exoskeleton import GUIDE, HINGE, LOWER, Misalignment, WornExoskeleton
from exo_env.settings import Settings

NET, GRIP, CUFF = "net", "grip", "cuff_force"
"""Inputs: moment that moves arm and link, moment between device and others [Nm]; sensor of the guide's force."""


class NominalElbow(Settings):
    """What a device takes for granted of itself and of whoever wears it."""

    device: Exoskeleton = Field(default_factory=lambda: Exoskeleton.named("elbow"))
    person: Person = Field(default=Person(), description="body that stands for everyone's")
    inertia_doubt: float = Field(
        default=0.3, ge=0.0, lt=1.0, description="deviation of a wearer's inertia from this body's, as a part of it"
    )

    def system(self, angle: float = 0.8) -> System:
        """The system, at rest at an elbow angle [rad]."""
        arm = Arm(self.person)
        worn = WornExoskeleton(self.device, arm, Misalignment())
        elbow, hinge = arm.axis, worn.frame[:, 2]
        return System(
            "nominal elbow",
            bodies=[b for b in (*arm.bodies(angle), *worn.bodies(angle)) if b.name in ("forearm", LOWER)],
            constraints=joints_on_the_ground(self.device, arm, worn),
            forces=[
                LumpedLoad(name="net_moment", body="forearm", moment=tuple(elbow), input=NET),
                LumpedLoad(name="grip_on_arm", body="forearm", moment=tuple(-elbow), input=GRIP),
                LumpedLoad(name="grip_on_link", body=LOWER, moment=tuple(hinge), input=GRIP),
            ],
            sensors=[
                JointAngle(name="exo_angle", joint=HINGE, pointer_i=tuple(worn.frame[:, 1]), pointer_j=(0.0, 1.0, 0.0)),
                JointReaction(name=CUFF, constraint=GUIDE, body="forearm", frame=LOWER),
                Imu(name=FOREARM_IMU, body="forearm", point=WRIST, gravity=arm.gravity),
            ],
            inputs=[Input(name=name, signal=Constant(value=0.0)) for name in (NET, GRIP)],
        )


def joints_on_the_ground(device: Exoskeleton, arm: Arm, worn: WornExoskeleton) -> list[Constraint]:
    """Elbow and hinge on the ground, guide between them."""
    axis, at = tuple(arm.axis), (0.0, -device.guide_distance, 0.0)
    hinge_axis = tuple(worn.frame[:, 2])
    return [
        Revolute(name=ELBOW, body_j="forearm", point_i=tuple(arm.elbow), point_j=(0.0, 0.0, 0.0), axis_i=axis,
                 axis_j=axis),
        Revolute(name=HINGE, body_j=LOWER, point_i=tuple(worn.origin), point_j=(0.0, 0.0, 0.0), axis_i=hinge_axis,
                 axis_j=(0.0, 0.0, 1.0)),
        PlaneGuide(name=GUIDE, body_i=LOWER, body_j="forearm", normal_i=(1.0, 0.0, 0.0), point_i=at,
                   point_j=tuple(worn.guided_point)),
    ]  # fmt: skip

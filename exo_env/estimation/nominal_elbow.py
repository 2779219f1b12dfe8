"""The elbow as a device knows it: a forearm of average size, its own lower link, and what it does not know as inputs.

    forearm      I theta'' = others + guide d          (with its weight in `others`, or beside it)
    lower link   I_l theta'' = sum tension_i arm_i + slip - guide d - friction theta' + weight

The body is that of a person of average size, whoever wears the device. `tension.<rope>` is an input that the rope's
sensor reads; `others` is the moment that everything but the device puts on the elbow; `slip` is what nominal moment
arms and friction of the device leave open. Upper arm and upper link stand still, so that they are part of the ground.
"""

from __future__ import annotations

from pydantic import Field

from dms_core.model import (
    Constant,
    ForceLoad,
    Gravity,
    Imu,
    Input,
    JointAngle,
    JointReaction,
    JointSpringDamper,
    LumpedLoad,
    PathPoint,
    PlaneGuide,
    Revolute,
    RopeForce,
    RopeSensor,
    System,
)
from dms_core.model.element import Constraint, Force, Sensor
from exo_env.ecosystem.arm import ELBOW, Arm
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.gym_machine import GymMachine, LoadedMachine
from exo_env.ecosystem.person import Person
from exo_env.ecosystem.sensors import FOREARM_IMU, WRIST, tension_sensor
from exo_env.ecosystem.worn_exoskeleton import GUIDE, HINGE, LOWER, Misalignment, WornExoskeleton
from exo_env.settings import Settings

OTHERS, SLIP, CUFF = "others", "slip", "cuff_force"
"""Inputs: moment of all but the device on the elbow [Nm], open moment at the hinge [Nm]; sensor of the guide's force."""
HAND, PULLS = ("hand.x", "hand.y"), ("pull_x", "pull_y")
"""Inputs that are the force on the hand, forwards and upwards [N], and the loads that they are."""


class NominalElbow(Settings):
    """What a device takes for granted of itself and of whoever wears it."""

    device: Exoskeleton = Field(default_factory=lambda: Exoskeleton.named("elbow"))
    person: Person = Field(default=Person(), description="body that stands for everyone's")
    lever_factor: float = Field(
        default=1.0, gt=0.5, lt=2.0, description="size of the horns that the ropes are tied to, over the device's own"
    )
    weight_of_arm: bool = Field(
        default=False, description="whether the forearm's weight is in the model, not in others"
    )
    load_cell: bool = Field(default=False, description="whether a cell measures the force on the hand")
    machine: GymMachine | None = Field(default=None, description="machine whose load is known; None: it is in others")
    load: float = Field(default=1.0, gt=0.0, description="known weight on that machine [kg]")

    def system(self, angle: float = 0.8) -> System:
        """The system, at rest at an elbow angle [rad]."""
        arm = Arm(self.person)
        worn = WornExoskeleton(self.device, arm, Misalignment())
        machine = [] if self.machine is None else [LoadedMachine(self.machine, arm, self.load)]
        bodies = [b for b in (*arm.bodies(angle), *worn.bodies(angle)) if b.name in ("forearm", LOWER)]
        heavy = [b.name for b in bodies if b.name == LOWER or self.weight_of_arm]
        heavy += [b.name for part in machine for b in part.bodies(angle)]
        inputs = (OTHERS, SLIP, *map(tension_input, self.device.ropes), *(HAND if self.load_cell else ()))
        return System(
            "nominal elbow",
            bodies=[*bodies, *(b for part in machine for b in part.bodies(angle))],
            constraints=[*self._joints(arm, worn), *(j for part in machine for j in part.joints())],
            forces=[
                Gravity(name="weight", acceleration=arm.gravity, bodies=tuple(heavy)), *self._forces(arm, worn),
                *(f for part in machine for f in part.forces()),
            ],
            sensors=self._sensors(worn),
            inputs=[Input(name=name, signal=Constant(value=0.0)) for name in inputs],
        )  # fmt: skip

    def _joints(self, arm: Arm, worn: WornExoskeleton) -> list[Constraint]:
        """Elbow and hinge on the ground, guide between them."""
        axis, at = tuple(arm.axis), (0.0, -self.device.guide_distance, 0.0)
        hinge_axis = tuple(worn.frame[:, 2])
        return [
            Revolute(name=ELBOW, body_j="forearm", point_i=tuple(arm.elbow), point_j=(0.0, 0.0, 0.0), axis_i=axis,
                     axis_j=axis),
            Revolute(name=HINGE, body_j=LOWER, point_i=tuple(worn.origin), point_j=(0.0, 0.0, 0.0), axis_i=hinge_axis,
                     axis_j=(0.0, 0.0, 1.0)),
            PlaneGuide(name=GUIDE, body_i=LOWER, body_j="forearm", normal_i=(1.0, 0.0, 0.0), point_i=at,
                       point_j=tuple(worn.guided_point)),
        ]  # fmt: skip

    def _forces(self, arm: Arm, worn: WornExoskeleton) -> list[Force]:
        """Ropes, friction, and what is not known."""
        found: list[Force] = [
            JointSpringDamper(name="hinge_friction", joint=HINGE, damping=self.device.hinge_damping),
            LumpedLoad(name="moment_of_others", body="forearm", moment=tuple(arm.axis), input=OTHERS),
            LumpedLoad(name="moment_of_slip", body=LOWER, moment=tuple(worn.frame[:, 2]), input=SLIP),
        ]
        if self.load_cell:
            found += [
                LumpedLoad(name=load, body="forearm", point=tuple(arm.grip), force=force, input=hand)
                for load, hand, force in zip(PULLS, HAND, ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), strict=True)
            ]
        for name, rope in self.device.ropes.items():
            upper = worn.origin + worn.frame @ rope.upper
            lower = (self.lever_factor * rope.lower[0], self.lever_factor * rope.lower[1], rope.lower[2])
            path = (PathPoint(point=tuple(upper)), PathPoint(body=LOWER, point=lower))
            found.append(RopeForce(name=name, path=path, input=tension_input(name)))
        return found

    def _sensors(self, worn: WornExoskeleton) -> list[Sensor]:
        """What the device measures, an inertial sensor on the wrist, and a load cell between hand and handle."""
        cell = [ForceLoad(name=f"{load}_cell", force=load, body="forearm") for load in PULLS] if self.load_cell else []
        return [
            JointAngle(name="exo_angle", joint=HINGE, pointer_i=tuple(worn.frame[:, 1]), pointer_j=(0.0, 1.0, 0.0)),
            *cell,
            *(RopeSensor(name=tension_sensor(r), rope=r, components=("tension",)) for r in self.device.ropes),
            JointReaction(name=CUFF, constraint=GUIDE, body="forearm", frame=LOWER),
            Imu(name=FOREARM_IMU, body="forearm", point=WRIST),
        ]


def tension_input(rope: str) -> str:
    """Name of the input that is a rope's tension [N]."""
    return f"tension.{rope}"

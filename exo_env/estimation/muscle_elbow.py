"""The elbow as a device with electrodes knows it: the nominal forearm with its six muscles, machine, own lower link.

    forearm      I_f theta'' = sum of r_i T_i + weight + machine + rest + F d       F the guide's force
    lower link   I_l theta'' = device + weight - F d

with the muscles' tensions T_i by the model's own muscles, whose activations are inputs that electrodes tell: how fast
a patient's muscles rise and fall is not known, and electrodes show the activation itself. `device` is what
ropes and friction put on the lower link, `rest` what the model does not know. Body and strength are those of a person
of average size, the muscles' attachments on the forearm lie too far from the elbow by a given part, as one measures
them, and their tendons are as much longer as keeps each fibre at its place where the elbow is at 90 degrees.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from dms_core.model import (
    Constant,
    Gravity,
    Imu,
    Input,
    JointAngle,
    JointReaction,
    LumpedLoad,
    MuscleSensor,
    PathPoint,
    RopeSensor,
    System,
    ThelenMuscle,
)
from dms_core.model.element import Vector
from dms_core.model.muscles.activation import MINIMUM
from exo_env.ecosystem.arm import Arm, excitation_name, path_geometry
from exo_env.ecosystem.gym_machine import ROPE, GymMachine, LoadedMachine
from exo_env.ecosystem.sensors import FOREARM_IMU, WRIST
from exo_env.ecosystem.worn_exoskeleton import HINGE, LOWER, Misalignment, WornExoskeleton
from exo_env.estimation.nominal_elbow import CUFF, NominalElbow, joints_on_the_ground

DEVICE, REST, ROPE_TENSION = "device", "rest", "gym_rope_tension"
"""Inputs: moment of ropes and friction on the link, moment that nothing explains [Nm]; sensor of the load cell."""


class MuscleElbow(NominalElbow):
    """What a device with electrodes takes for granted of itself, of the machine and of whoever wears it."""

    machine: GymMachine
    farther: float = Field(
        default=1.05, gt=0.0, description="distance of the muscles' points on the forearm over the true one [-]"
    )

    def arm(self) -> Arm:
        """The arm of the person, without the error of its attachments."""
        return Arm(self.person)

    def muscle(self, arm: Arm, name: str) -> ThelenMuscle:
        """A muscle whose points on the forearm are moved out, and whose path is as much longer at 90 degrees."""
        path, right_angle = self.path(arm, name), math.radians(90.0)
        longer = path_geometry(arm, path, right_angle)[0] - arm.muscle_geometry(name, right_angle)[0]
        slack = arm.muscle(name).tendon_slack_length + longer
        return arm.muscle(name, path=path, tendon_slack_length=slack, activation_dynamics=False)

    def path(self, arm: Arm, name: str) -> tuple[PathPoint, ...]:
        """Points of a muscle on ground and forearm."""
        return tuple(
            PathPoint(body=p.body, point=_scaled(p.point, self.farther)) if p.body == "forearm" else p
            for p in arm.path(name, welded=True)
        )

    def lever(self, arm: Arm, name: str, angle: float) -> float:
        """Moment arm of a muscle, positive for a flexor [m]."""
        return path_geometry(arm, self.path(arm, name), angle)[1]

    def system(self, angle: float = 0.8, load: float = 1.25, activations: np.ndarray | None = None) -> System:
        """The system, at rest at an elbow angle [rad], with a load [kg] and activations of the muscles [-]."""
        arm = self.arm()
        worn = WornExoskeleton(self.device, arm, Misalignment())
        machine = LoadedMachine(self.machine, arm, load)
        start = np.full(len(arm.muscles), MINIMUM) if activations is None else activations
        bodies = [b for b in (*arm.bodies(angle), *worn.bodies(angle)) if b.name in ("forearm", LOWER)]
        muscles = [self.muscle(arm, m) for m in arm.muscles]
        drives = [Input(name=excitation_name(m), signal=Constant(value=float(a)))
                  for m, a in zip(arm.muscles, start, strict=True)]  # fmt: skip
        return System(
            "nominal elbow with muscles",
            bodies=[*bodies, *machine.bodies(angle)],
            constraints=[*joints_on_the_ground(self.device, arm, worn), *machine.joints()],
            forces=[
                Gravity(name="gravity", acceleration=arm.gravity), *muscles, *machine.forces(),
                LumpedLoad(name="rest_on_arm", body="forearm", moment=tuple(arm.axis), input=REST),
                LumpedLoad(name="device_on_link", body=LOWER, moment=tuple(worn.frame[:, 2]), input=DEVICE),
            ],
            sensors=[
                JointAngle(name="exo_angle", joint=HINGE, pointer_i=tuple(worn.frame[:, 1]), pointer_j=(0.0, 1.0, 0.0)),
                JointReaction(name=CUFF, constraint="guide", body="forearm", frame=LOWER),
                Imu(name=FOREARM_IMU, body="forearm", point=WRIST, gravity=arm.gravity),
                RopeSensor(name=ROPE_TENSION, rope=ROPE, components=("tension",)),
                *(MuscleSensor(name=f"{m}.sensor", muscle=m, components=("activation", "tendon_force"))
                  for m in arm.muscles),
            ],
            inputs=[*(Input(name=name, signal=Constant(value=0.0)) for name in (REST, DEVICE)), *drives],
        )  # fmt: skip


def _scaled(point: Vector, factor: float) -> Vector:
    """A point farther from the origin of its frame."""
    x, y, z = point
    return (factor * x, factor * y, factor * z)

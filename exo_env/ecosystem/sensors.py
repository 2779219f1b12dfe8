"""The virtual sensors of the ecosystem, by name: what the paper's figures show, and whether a run can be believed."""

from __future__ import annotations

from dms_core.model import ForceLoad, Imu, JointAngle, JointMoment, JointReaction, MuscleSensor, RopeSensor, Tracking
from dms_core.model.element import Sensor
from dms_core.model.sensors.muscle import Component
from exo_env.ecosystem.arm import ELBOW
from exo_env.ecosystem.gym_machine import ROPE
from exo_env.ecosystem.worn_exoskeleton import GUIDE, HINGE, LOWER, PID

MUSCLE_COMPONENTS: tuple[Component, ...] = ("length", "fibre_length", "fibre_velocity", "activation", "tendon_force")


FOREARM_IMU = "forearm_imu"
"""Name of the inertial sensor on the forearm."""
WRIST = (0.0, -0.2, 0.0)
"""Where it is worn, in the frame of the forearm [m]; assumed: a bracelet above the wrist, 0.2 m from the elbow."""


def muscle_sensor(muscle: str, component: Component) -> str:
    """Name of a component of a muscle's sensor."""
    return f"{muscle}.sensor.{component}"


def tension_sensor(rope: str) -> str:
    """Name of the sensor of a rope's tension."""
    return f"{rope}_tension"


def sensors(muscles: tuple[str, ...], ropes: tuple[str, ...], *, gym: bool, compliant: bool = False) -> list[Sensor]:
    """Sensors of a system.

    Args:
        muscles: names of the muscles.
        ropes: names of the device's ropes.
        gym: whether the hand holds the handle of a gym machine.
        compliant: whether a compliant cuff, and no guide, holds the forearm.
    """
    load_on_forearm = (
        ForceLoad(name="guide_force", force=GUIDE, body="forearm")
        if compliant
        else JointReaction(name="guide_force", constraint=GUIDE, body="forearm")
    )
    gym_rope = [RopeSensor(name="gym_rope_tension", rope=ROPE, components=("tension",))] if gym else []
    return [
        JointAngle(name="elbow_angle", joint=ELBOW),
        JointAngle(name="exo_angle", joint=HINGE),
        Tracking(name="tracking", pid=PID),
        *(MuscleSensor(name=f"{m}.sensor", muscle=m, components=MUSCLE_COMPONENTS) for m in muscles),
        *(RopeSensor(name=tension_sensor(rope), rope=rope, components=("tension",)) for rope in ropes),
        *gym_rope,
        JointMoment(name="muscle_moment", joint=ELBOW, elements=muscles, bodies=("forearm",)),
        JointMoment(name="exo_moment", joint=HINGE, elements=ropes, bodies=(LOWER,)),
        JointReaction(name="elbow_reaction", constraint=ELBOW, body="forearm"),
        load_on_forearm,
        Imu(name=FOREARM_IMU, body="forearm", point=WRIST),
    ]

"""The human-exoskeleton ecosystem of Fig. 8 as one dms_core System: subject, exoskeleton, gym machine, their joints.

Seven bodies with 49 coordinates; 7 unit norms and 40 rows of joints: fixed 6 (torso), fixed 6 (shoulder), revolute 5
(elbow), fixed 6 (cuff), revolute 5 (hinge), guide 1, revolute 5 (grip), slider 5 (weight), rope 1. Two freedoms are
left, the elbow and the swing of the handle.

Inputs: "psi" the reference [rad], "assistance" the authority of the controller [-], "excitation.<muscle>" [-].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Self

from pydantic import Field, model_validator

from dms_core.model import (
    Constant,
    DelayedError,
    Gravity,
    Input,
    JointAngle,
    JointMoment,
    JointReaction,
    MuscleSensor,
    RopeSensor,
    System,
    Tracking,
)
from dms_core.model.element import Force, Sensor
from dms_core.model.muscles.activation import MINIMUM
from dms_core.model.sensors.muscle import Component
from dms_core.model.signals import AnySignal
from exo_env.ecosystem.arm import ELBOW, FLEXORS, MUSCLES, Arm, Person, excitation_name
from exo_env.ecosystem.exoskeleton import (
    AGONIST,
    ANTAGONIST,
    GUIDE,
    HINGE,
    LOWER,
    PID,
    Exoskeleton,
    GuideKind,
    Misalignment,
    WornExoskeleton,
)
from exo_env.ecosystem.gym_machine import ROPE, GymMachine, LoadedMachine
from exo_env.settings import Settings

REFERENCE, ASSISTANCE, REFLEX = "psi", "assistance", "proprioception"
MUSCLE_COMPONENTS: tuple[Component, ...] = ("length", "fibre_length", "fibre_velocity", "activation", "tendon_force")


class Proprioception(Settings):
    """Weak, late feedback of the elbow's angle to the muscles' excitations."""

    gain: float = Field(
        default=0.0, ge=0.0, description="excitation of the flexors per error [1/rad]; extensors minus it"
    )
    delay: float = Field(default=0.06, gt=0.0, description="mean delay [s]")


class Ecosystem(Settings):
    """What is joined. The defaults are the paper's system with arm26 and one kilogram."""

    person: Person = Person()
    device: Exoskeleton = Field(default_factory=lambda: Exoskeleton.from_config("exoskeletons/elbow.yaml"))
    machine: GymMachine | None = Field(
        default_factory=lambda: GymMachine.from_config("gym_machine/pulley.yaml"), description="None: the hand is empty"
    )
    weight: float = Field(default=1.0, gt=0.0, description="mass of the weight [kg]")
    guide: GuideKind = Field(default="plane", description="guide between lower link and forearm: 1, 2 or 5 rows")
    misalignment: Misalignment = Misalignment()
    proprioception: Proprioception = Proprioception()

    @model_validator(mode="after")
    def _free_elbow(self) -> Self:
        """A line or prismatic guide leaves an elbow free only if its axis is that of the hinge."""
        if self.guide != "plane" and self.misalignment != Misalignment():
            raise ValueError(
                f"guide '{self.guide}' with a misaligned device locks the elbow; the one-row guide 'plane' lets it move"
            )
        return self

    def system(
        self,
        start: float,
        reference: AnySignal,
        excitations: Mapping[str, AnySignal] | None = None,
        *,
        assistance: float = 1.0,
        start_activation: Mapping[str, float] | None = None,
        start_tension: float | None = None,
        muscle_times: Mapping[str, float] | None = None,
        device_forces: Callable[[WornExoskeleton], list[Force]] | None = None,
        device_inputs: Sequence[Input] | None = None,
    ) -> System:
        """The declared system, at rest at the start.

        Args:
            start: elbow angle [rad].
            reference: course of psi [rad].
            excitations: course of each muscle's excitation [-]; a muscle that is not named stays at its minimum.
            assistance: authority of the controller, 0 to 1 [-].
            start_activation: activation of each muscle at the start [-]; default: the minimum.
            start_tension: of the agonist rope [N]; default: that of a command without error.
            muscle_times: activation and deactivation time constants of every muscle, as fields of ThelenMuscle [s].
            device_forces: controller, motors and ropes of the worn device; default: its own PID on both ropes.
            device_inputs: inputs that these read beside the reference; default: the authority.
        """
        arm = Arm(self.person)
        worn = WornExoskeleton(self.device, arm, self.misalignment, self.guide)
        machine = [] if self.machine is None else [LoadedMachine(self.machine, arm, self.weight)]
        parts: list[Arm | WornExoskeleton | LoadedMachine] = [arm, worn, *machine]
        commands: dict[str, AnySignal] = {m: (excitations or {}).get(m, Constant(value=MINIMUM)) for m in MUSCLES}
        return System(
            "human-exoskeleton ecosystem",
            bodies=[body for part in parts for body in part.bodies(start)],
            constraints=[joint for part in parts for joint in part.joints()],
            forces=[
                Gravity(name="gravity", acceleration=arm.gravity),
                *self._muscles(arm, start_activation or {}, muscle_times or {}),
                *(
                    device_forces(worn)
                    if device_forces
                    else worn.forces(REFERENCE, ASSISTANCE, start_tension=start_tension)
                ),
                *(force for part in machine for force in part.forces()),
            ],
            sensors=sensors(gym=self.machine is not None),
            inputs=[
                Input(name=REFERENCE, signal=reference),
                *(device_inputs or [Input(name=ASSISTANCE, signal=Constant(value=assistance))]),
                *(Input(name=excitation_name(m), signal=s) for m, s in commands.items()),
            ],
        )

    def _muscles(self, arm: Arm, start_activation: Mapping[str, float], times: Mapping[str, float]) -> list[Force]:
        """The six muscles, behind the feedback that they read."""
        p = self.proprioception
        forces: list[Force] = []
        if p.gain > 0.0:
            forces.append(DelayedError(name=REFLEX, joint=ELBOW, reference=REFERENCE, delay=p.delay))
        for m in MUSCLES:
            reflex = {"reflex": f"{REFLEX}.error", "reflex_gain": p.gain if m in FLEXORS else -p.gain} if p.gain else {}
            forces.append(arm.muscle(m, start_activation=start_activation.get(m, MINIMUM), **reflex, **times))
        return forces


def sensors(*, gym: bool) -> list[Sensor]:
    """What the paper's figures show, and what tells whether a run can be believed; `gym`: a weight is in the hand."""
    gym_rope = [RopeSensor(name="gym_rope_tension", rope=ROPE, components=("tension",))] if gym else []
    return [
        JointAngle(name="elbow_angle", joint=ELBOW),
        JointAngle(name="exo_angle", joint=HINGE),
        Tracking(name="tracking", pid=PID),
        *(MuscleSensor(name=f"{m}.sensor", muscle=m, components=MUSCLE_COMPONENTS) for m in MUSCLES),
        RopeSensor(name="agonist_tension", rope=AGONIST, components=("tension",)),
        RopeSensor(name="antagonist_tension", rope=ANTAGONIST, components=("tension",)),
        *gym_rope,
        JointMoment(name="muscle_moment", joint=ELBOW, elements=MUSCLES, bodies=("forearm",)),
        JointMoment(name="exo_moment", joint=HINGE, elements=(AGONIST, ANTAGONIST), bodies=(LOWER,)),
        JointReaction(name="elbow_reaction", constraint=ELBOW, body="forearm"),
        JointReaction(name="guide_force", constraint=GUIDE, body="forearm"),
    ]

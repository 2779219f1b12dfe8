"""The human-exoskeleton ecosystem of Fig. 8 as one dms_core System: subject, exoskeleton, gym machine, their joints.

Seven bodies with 49 coordinates; 7 unit norms and 40 rows of joints: fixed 6 (torso), fixed 6 (shoulder), revolute 5
(elbow), fixed 6 (cuff), revolute 5 (hinge), guide 1, revolute 5 (grip), slider 5 (weight), rope 1. Two freedoms are
left, the elbow and the swing of the handle.

Inputs: "psi" the reference [rad], "assistance" the authority of the controller [-], "excitation.<muscle>" [-].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, Self

from pydantic import Field, model_validator

from dms_core.model import Constant, DelayedError, Gravity, Input, RigidBody, System
from dms_core.model.element import Constraint, Force
from dms_core.model.muscles.activation import MINIMUM
from dms_core.model.signals import AnySignal
from exo_env.ecosystem.arm import ELBOW, Arm, excitation_name
from exo_env.ecosystem.cuff import Cuff
from exo_env.ecosystem.exoskeleton import DEFAULT as DEFAULT_DEVICE
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.gym_machine import GymMachine, LoadedMachine
from exo_env.ecosystem.person import Person
from exo_env.ecosystem.sensors import sensors
from exo_env.ecosystem.subject import DEFAULT, AnySubject, read_subject
from exo_env.ecosystem.worn_exoskeleton import GuideKind, Misalignment, WornExoskeleton
from exo_env.settings import Settings

REFERENCE, ASSISTANCE, REFLEX = "psi", "assistance", "proprioception"


class Part(Protocol):
    """A part of the system beside arm, device and machine."""

    def bodies(self, flexion: float) -> Sequence[RigidBody]:
        """Bodies of the part where the elbow rests at an angle [rad]."""

    def joints(self) -> Sequence[Constraint]:
        """Joints that hold these bodies."""

    def forces(self) -> Sequence[Force]:
        """Forces on these bodies, or on those of arm, device and machine."""


class Proprioception(Settings):
    """Weak, late feedback of the elbow's angle to the muscles' excitations."""

    gain: float = Field(
        default=0.0, ge=0.0, description="excitation of the flexors per error [1/rad]; extensors minus it"
    )
    delay: float = Field(default=0.06, gt=0.0, description="mean delay [s]")


class Ecosystem(Settings):
    """Person, device and machine that are joined. The defaults are the paper's system with arm26 and one kilogram."""

    person: Person = Person()
    subject: AnySubject = Field(
        default_factory=lambda: read_subject(DEFAULT), description="anatomy: a shipped subject by name, or a YAML file"
    )
    device: Exoskeleton = Field(default_factory=lambda: Exoskeleton.named(DEFAULT_DEVICE))
    machine: GymMachine | None = Field(
        default_factory=lambda: GymMachine.from_config("gym_machine/pulley.yaml"), description="None: the hand is empty"
    )
    weight: float = Field(default=1.0, gt=0.0, description="mass of the weight [kg]")
    guide: GuideKind = Field(default="plane", description="guide between lower link and forearm: 1, 2 or 5 rows")
    cuff: Cuff | None = Field(default=None, description="compliant cuff in place of the guide; None: the guide")
    misalignment: Misalignment = Misalignment()
    proprioception: Proprioception = Proprioception()

    @model_validator(mode="after")
    def _free_elbow(self) -> Self:
        """A line or prismatic guide leaves an elbow free only if its axis is that of the hinge."""
        if self.guide != "plane" and self.cuff is not None:
            raise ValueError(f"guide '{self.guide}' and a cuff are both given; expected one of them")
        if self.guide != "plane" and self.misalignment != Misalignment():
            raise ValueError(
                f"guide '{self.guide}' with a misaligned device locks the elbow; the one-row guide 'plane' lets it move"
            )
        return self

    def arm(self) -> Arm:
        """The arm of the person."""
        return Arm(self.person, self.subject)

    def worn(self) -> WornExoskeleton:
        """The device on this arm."""
        return WornExoskeleton(self.device, self.arm(), self.misalignment, self.guide, self.cuff)

    def more_parts(self, arm: Arm, worn: WornExoskeleton) -> Sequence[Part]:
        """Parts beside arm, device and machine: none here; an ecosystem of one's own gives them.

        In an environment their bodies must not move where the elbow rests, and every number of theirs must be linear in
        the monomials of world/kernels/scaling.py, as that of a constant spring, of a mass or of a length that grows
        with the height is; a number that is not is refused by name.
        """
        return ()

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
            reference: psi over time [rad].
            excitations: excitation of each muscle over time [-]; a muscle that is not named stays at its minimum.
            assistance: authority of the controller, 0 to 1 [-].
            start_activation: activation of each muscle at the start [-]; default: the minimum.
            start_tension: tension of the rope that lifts [N]; default: that of a command without error.
            muscle_times: activation and deactivation time constants of every muscle, as fields of ThelenMuscle [s].
            device_forces: controller, motors and ropes of the worn device; default: its own PID on all ropes.
            device_inputs: inputs that these read beside the reference; default: the authority.
        """
        arm, worn = self.arm(), self.worn()
        machine = [] if self.machine is None else [LoadedMachine(self.machine, arm, self.weight)]
        beside = [*machine, *self.more_parts(arm, worn)]
        parts: list[Arm | WornExoskeleton | Part] = [arm, worn, *beside]
        given = excitations or {}
        commands: dict[str, AnySignal] = {m: given.get(m, Constant(value=MINIMUM)) for m in arm.muscles}
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
                *(force for part in beside for force in part.forces()),
                *arm.forces(),
                *worn.cushions(),
            ],
            sensors=sensors(
                arm.muscles, tuple(self.device.ropes), gym=self.machine is not None, compliant=self.cuff is not None
            ),
            inputs=[
                Input(name=REFERENCE, signal=reference),
                *(device_inputs or [Input(name=ASSISTANCE, signal=Constant(value=assistance))]),
                *(Input(name=excitation_name(m), signal=s) for m, s in commands.items()),
            ],
        )

    def _muscles(self, arm: Arm, start_activation: Mapping[str, float], times: Mapping[str, float]) -> list[Force]:
        """The muscles, behind the feedback that they read."""
        p = self.proprioception
        forces: list[Force] = []
        if p.gain > 0.0:
            forces.append(DelayedError(name=REFLEX, joint=ELBOW, reference=REFERENCE, delay=p.delay))
        for m, sign in zip(arm.muscles, arm.signs.tolist(), strict=True):
            reflex = {"reflex": f"{REFLEX}.error", "reflex_gain": sign * p.gain} if p.gain else {}
            forces.append(arm.muscle(m, start_activation=start_activation.get(m, MINIMUM), **reflex, **times))
        return forces

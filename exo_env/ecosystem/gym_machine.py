"""The gym equipment (paper sect. 4.1): handle in the hand, rope of fixed length over two pulleys, sliding weight.

The rope holds both ways in the equations; its tension is reported, and a negative one, which a run flags, means a slack
rope.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from dms_core.bracket import narrowed, trial
from dms_core.compiled.jit import compiled
from dms_core.errors import InputError
from dms_core.model import GROUND, JointSpringDamper, PathPoint, Revolute, RigidBody, RopeLength, Slider
from dms_core.model.element import Constraint, Force, Vector
from dms_core.model.geometry.frames import quaternion
from dms_core.model.geometry.rotations import cross, dot, scale, sub, turned
from exo_env.ecosystem.arm import Arm
from exo_env.settings import Settings

HANDLE, WEIGHT, ROPE, GRIP_JOINT = "handle", "weight", "gym_rope", "grip"
MOST_TRIALS = 200
"""Trials of the handle's angle; its bracket is empty long before."""


class Handle(Settings):
    """Handle that swings about the grip in the hand."""

    mass: float = Field(gt=0.0, description="mass [kg]")
    length: float = Field(gt=0.0, description="from the grip to the rope [m]")
    centre_of_mass: float = Field(ge=0.0, description="from the grip towards the rope [m]")
    inertia: float = Field(gt=0.0, description="about every axis through its centre of mass [kg m^2]")
    damping: float = Field(ge=0.0, description="friction of the grip [N m s/rad]")


class GymMachine(Settings):
    """A machine, as in configs/gym_machine."""

    handle: Handle
    low_pulley: Vector = Field(description="in ground axes [m]")
    high_pulley: Vector = Field(description="in ground axes [m]; the weight hangs below it")
    weight_start: float = Field(description="height of the weight at the start [m]")
    weight_inertia: float = Field(gt=0.0, description="inertia over mass of the weight [m^2]")


@compiled
def _handle_moment(axis, gravity, to_pulley, handle, weight, angle):
    """Moment about the grip that turns the handle back [Nm]: of the rope and of its own weight."""
    down = turned(axis, math.cos(angle), math.sin(angle), (0.0, -1.0, 0.0))
    length = handle[1]
    pull = sub(to_pulley, scale(length, down))
    tension = weight * math.sqrt(dot(gravity, gravity)) / math.sqrt(dot(pull, pull))
    return -(length * tension * dot(axis, cross(down, pull)) + handle[0] * handle[2] * dot(axis, cross(down, gravity)))


@compiled
def handle_angle(axis, gravity, to_pulley, handle, weight):
    """Angle about the elbow axis, from hanging straight down, at which the handle rests [rad].

    The rope pulls with the weight's force, the handle has its own, and the grip turns freely.

    Args:
        axis: axis of the elbow, a triple.
        gravity: gravity, a triple [m/s^2].
        to_pulley: vector from the grip to the low pulley, a triple [m].
        handle: its mass [kg], its length [m], distance of the centre of mass from the grip [m].
        weight: mass on the rope [kg].
    """
    about = math.atan2(to_pulley[0], -to_pulley[1])
    low, high, moved = about - 1.5, about + 1.5, 0.0
    f_low = _handle_moment(axis, gravity, to_pulley, handle, weight, low)
    f_high = _handle_moment(axis, gravity, to_pulley, handle, weight, high)
    for _ in range(MOST_TRIALS):
        x = trial(low, f_low, high, f_high)
        if not low < x < high:
            break
        f = _handle_moment(axis, gravity, to_pulley, handle, weight, x)
        low, f_low, high, f_high, moved = narrowed(low, f_low, high, f_high, moved, x, f)
    return 0.5 * (low + high)


@compiled
def clearances(elbow, grip, handle_length, low_pulley, room):
    """Room between the ends of the rope and the pulleys, above 0 where they cannot meet [m].

    The handle's end goes as far as grip and handle reach from the elbow; the weight, which begins `room` [m] below the
    high pulley, can rise by twice that.

    Returns:
        (at the low pulley, at the high one, the reach)
    """
    d, reach = sub(low_pulley, elbow), math.sqrt(dot(grip, grip)) + handle_length
    return math.sqrt(dot(d, d)) - reach, room - 2.0 * reach, reach


def check_reach(machine: GymMachine, elbow: np.ndarray, grip: np.ndarray) -> None:
    """Refuse a machine whose rope an arm could bring to a pulley: its length has a kink there.

    Args:
        machine: the machine.
        elbow: centre of the elbow in ground axes [m].
        grip: centre of the grip in the forearm's frame [m].

    Raises:
        InputError: an end of the rope could reach a pulley, and nothing stops the weight.
    """
    if min(_clearances(machine, elbow, grip)[:2]) <= 0.0:
        raise reach_error(machine, elbow, grip)


def reach_error(machine: GymMachine, elbow: np.ndarray, grip: np.ndarray) -> InputError:
    """The error of `check_reach`, about the pulley that is nearer to being reached."""
    low, high, reach = _clearances(machine, elbow, grip)
    if high < low:
        return InputError(
            f"high_pulley = {machine.high_pulley} is {high + 2.0 * reach:.4g} m above weight_start = "
            f"{machine.weight_start}; the weight can rise by {2.0 * reach:.4g} m, and the pulley must be higher."
        )
    return InputError(
        f"low_pulley = {machine.low_pulley} is {low + reach:.4g} m from the elbow, and the handle reaches "
        f"{reach:.4g} m; it must be out of reach."
    )


def _clearances(machine: GymMachine, elbow: np.ndarray, grip: np.ndarray) -> tuple[float, float, float]:
    room = machine.high_pulley[1] - machine.weight_start
    return clearances(tuple(elbow), tuple(grip), machine.handle.length, machine.low_pulley, room)


class LoadedMachine:
    """A machine with a weight, its handle in a hand.

    Args:
        machine: the machine.
        arm: arm whose hand holds the handle.
        mass: mass of the weight [kg].

    Raises:
        InputError: see check_reach.
    """

    def __init__(self, machine: GymMachine, arm: Arm, mass: float) -> None:
        self.machine, self.arm, self.mass = machine, arm, mass
        check_reach(machine, arm.elbow, arm.grip)

    def rest_angle(self, flexion: float) -> float:
        """Angle of the handle about the elbow axis, from hanging straight down, at which it rests [rad].

        The rope pulls with the weight's force, the handle has its own, and the grip turns freely.
        """
        m = self.machine
        grip = self.arm.elbow + self.arm.rotation(flexion) @ self.arm.grip
        to_pulley = np.array(m.low_pulley) - grip
        numbers = np.array([m.handle.mass, m.handle.length, m.handle.centre_of_mass])
        return handle_angle(tuple(self.arm.axis), self.arm.gravity, tuple(to_pulley), numbers, float(self.mass))

    def bodies(self, flexion: float) -> list[RigidBody]:
        """Handle at rest in the hand of an elbow at `flexion` [rad], and the weight."""
        m = self.machine
        x, _, z = m.high_pulley
        grip = self.arm.elbow + self.arm.rotation(flexion) @ self.arm.grip
        return [
            RigidBody(
                name=HANDLE,
                mass=m.handle.mass,
                inertia=(m.handle.inertia,) * 3,
                centre_of_mass=(0.0, -m.handle.centre_of_mass, 0.0),
                position=tuple(grip),
                orientation=tuple(quaternion(self.arm.axis, self.rest_angle(flexion))),
            ),
            RigidBody(
                name=WEIGHT,
                mass=self.mass,
                inertia=(self.mass * m.weight_inertia,) * 3,
                position=(x, m.weight_start, z),
            ),
        ]

    def joints(self) -> list[Constraint]:
        """Handle in the hand, weight on its rail, rope."""
        m, axis = self.machine, tuple(self.arm.axis)
        rail = (m.high_pulley[0], m.weight_start, m.high_pulley[2])
        path = (
            PathPoint(body=HANDLE, point=(0.0, -m.handle.length, 0.0)),
            PathPoint(body=GROUND, point=m.low_pulley),
            PathPoint(body=GROUND, point=m.high_pulley),
            PathPoint(body=WEIGHT, point=(0.0, 0.0, 0.0)),
        )
        return [
            Revolute(
                name=GRIP_JOINT, body_i="forearm", body_j=HANDLE, point_i=tuple(self.arm.grip),
                point_j=(0.0, 0.0, 0.0), axis_i=axis, axis_j=axis,
            ),
            Slider(name="rail", body_j=WEIGHT, axis_i=(0.0, 1.0, 0.0), point_i=rail),
            RopeLength(name=ROPE, path=path),
        ]  # fmt: skip

    def forces(self) -> list[Force]:
        """Friction of the grip."""
        return [JointSpringDamper(name="grip_friction", joint=GRIP_JOINT, damping=self.machine.handle.damping)]

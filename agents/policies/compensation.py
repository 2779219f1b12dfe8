"""The paper's PID with compensation of gravity and load, through the setpoint.

The environment lets a policy change the setpoint, not the tension. A setpoint change o adds kp o + ki int(o) dt to the
controller's command, so

    kp o + ki int(o) dt = M(psi) / r(psi)

makes it give the agonist tension that holds a share of arm, lower link and weight at rest: M this share of their moment
about the elbow, r the rope's moment arm. psi is that of 0.1 s ahead, since the setpoint's filter (20 rad/s, critically
damped) comes 0.1 s late. The share, the authority and a constant lag of the setpoint are tuned (tuning.py); as the
authority scales the whole command, the ropes give authority times share. The moment is that of an average man's
proportions with the patient's mass and height, and the weight is read off the machine: numbers that a therapist has,
from the "privileged" group. The patient's own effort is not subtracted: of who can lift, the PID has to take the
surplus back, and tracking may get worse.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import gymnasium
import numpy as np

from exo_env.ecosystem.arm import Person
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.patient.excitation.motor_command import InternalModel

from .lagging_pid import LaggingPid
from .policy import Channels, Policy
from .tuned import Range, numbers

AHEAD = 0
"""Component of the preview that is 0.1 s ahead."""
ANGLES = np.radians(np.linspace(0.0, 142.0, 143))
"""At which the holding tension is tabulated [rad]; the table errs by less than 0.1 N."""


def holding_tensions(ecosystem: Ecosystem, person: Person, load: float, angles: np.ndarray) -> np.ndarray:
    """Agonist tension that holds arm, lower link and weight without muscles [N].

    Args:
        ecosystem: device and machine.
        person: whose arm it is.
        load: weight on the machine [kg].
        angles: of the elbow [rad], shape (n,).
    """
    assert ecosystem.machine is not None
    arm, device = ecosystem.changed(person=person).arm(), ecosystem.device
    known, g = InternalModel.of(arm, ecosystem.machine, load), float(np.linalg.norm(arm.gravity))
    moments = [known.resting_moment(angle) + device.own_moment(angle, g) for angle in map(float, angles)]
    rope = device.lifting_rope
    return np.array(moments) / [device.moment_arm(rope, angle) for angle in map(float, angles)]


class CompensatedPid(Policy):
    """PID and part of the holding tension.

    Args:
        share: of the holding tension [-].
        authority: share of the PID's command that the ropes follow [-].
        lag_deg: by which the setpoint is below the reference [deg].
    """

    name, title, action_mode = "pid_compensated", "PID with compensation", "pid_setpoint"
    observation = ("device", "privileged")
    ranges: ClassVar[dict[str, Range]] = {"share": Range(0.0, 1.0), **LaggingPid.ranges}

    def __init__(self, **given: float) -> None:
        used = numbers(self.name, self.ranges, given)
        self.share, self.authority, self.lag = used["share"], used["authority"], math.radians(used["lag_deg"])

    def reset(self, env: gymnasium.Env) -> None:
        """Forget the last patient."""
        world: Any = env.unwrapped
        self._ecosystem, self._channels = world.ecosystem, Channels(env)
        self._range, self._period = world.drive.setpoint_range, world.period
        self._tensions: np.ndarray | None = None
        self._integral = 0.0

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """The setpoint change that stands for the holding tension and the lag, and the authority."""
        held = float(
            np.interp(self._channels.read(observation, "device.preview", AHEAD), ANGLES, self.held(observation))
        )
        gains = self._ecosystem.device.gains
        change = (self.share * held - gains.ki * self._integral) / gains.kp
        change = min(max(change, self.lag - self._range), self._range)
        self._integral += change * self._period
        return np.array([(change - self.lag) / self._range, 2.0 * self.authority - 1.0]).clip(-1.0, 1.0)

    def held(self, observation: np.ndarray) -> np.ndarray:
        """Holding tension of this patient and load over ANGLES [N]; they stay the same in an episode."""
        if self._tensions is None:
            read = self._channels.read
            mass, height, load = (read(observation, f"privileged.{name}") for name in ("body_mass", "height", "load"))
            self._tensions = holding_tensions(self._ecosystem, Person(body_mass=mass, height=height), load, ANGLES)
        return self._tensions

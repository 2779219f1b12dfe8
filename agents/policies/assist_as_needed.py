"""Assistance as needed after Wolbrecht, Chan, Reinkensmeyer and Bobrow (2008, IEEE TNSRE 16:286-297), on one joint.

The device gives the moment

    M = Y w + kp e + kd edot,    dw/dt = gain Y^T (edot + slope e) - Y^T (Y Y^T)^-1 Y w / memory

with the error e = psi - theta. Y are Gaussians over the elbow angle, here scaled to the sum 1, so that equal weights
are a constant moment. The first part of dw/dt learns what the patient lacks; the second, which their paper adds,
forgets: it lowers Y w, and nothing else, with the time constant `memory`, so that the patient has to take over. Weights
begin with the moment of the agonist at the start. Moments become tensions by the moment arms of the device.

Their abstract describes model-based adaptive control with a force-reducing term that decays the robot's force where
errors are small; the equations are ours to that description, and not checked against the text of the paper. The gains
are tuned for return on the training population (tuning.py).
"""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np

from .policy import Channels, Policy
from .tuned import Range, numbers

CENTRES = np.radians(np.arange(0.0, 150.0, 15.0))
WIDTH = np.radians(15.0)
"""Standard deviation of the Gaussians [rad]."""


class AssistAsNeeded(Policy):
    """Learned moment with forgetting, and a soft controller.

    Args:
        stiffness: kp [Nm/rad].
        damping: kd [N m s/rad].
        gain: of learning [Nm/rad].
        slope: of the error beside its rate [1/s].
        memory: time constant of forgetting [s].
    """

    name, title, action_mode = "assist_as_needed", "assist as needed", "rope_tension"

    ranges: ClassVar[dict[str, Range]] = {
        "stiffness": Range(10.0, 200.0, True),
        "damping": Range(0.5, 8.0, True),
        "gain": Range(2.0, 200.0, True),
        "slope": Range(1.0, 20.0, True),
        "memory": Range(0.2, 8.0, True),
    }

    def __init__(self, **given: float) -> None:
        used = numbers(self.name, self.ranges, given)
        self.stiffness, self.damping, self.gain = used["stiffness"], used["damping"], used["gain"]
        self.slope, self.memory = used["slope"], used["memory"]

    def reset(self, env: gymnasium.Env) -> None:
        """Forget the last patient."""
        world: Any = env.unwrapped
        self._device, self._largest, self._period = world.ecosystem.device, world.drive.max_tension, world.period
        self._channels = Channels(env)
        self.weights: np.ndarray | None = None

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """Tensions that give the moment; the weights learn from the present error."""
        names = ("angle", "rate", "reference", "reference_rate")
        angle, rate, reference, reference_rate = (self._channels.read(observation, f"device.{n}") for n in names)
        error, error_rate = reference - angle, reference_rate - rate
        if self.weights is None:
            rope = self._device.lifting_rope
            place = list(self._device.ropes).index(rope)
            held = self._channels.read(observation, "device.tension", place) * self._device.moment_arm(rope, angle)
            self.weights = np.full(CENTRES.size, held)
        basis = gaussians(angle)
        self.learn(basis, error, error_rate)
        moment = float(basis @ self.weights) + self.stiffness * error + self.damping * error_rate
        return self._action(moment, angle)

    def learn(self, basis: np.ndarray, error: float, error_rate: float) -> None:
        """One control period of learning and forgetting, both exact where the basis stands still."""
        assert self.weights is not None
        size = float(basis @ basis)
        kept = np.exp(-self._period / self.memory)
        self.weights = self.weights - basis * (1.0 - kept) * float(basis @ self.weights) / size
        self.weights = self.weights + self._period * self.gain * basis * (error_rate + self.slope * error)

    def _action(self, moment: float, angle: float) -> np.ndarray:
        """Commands of the ropes that give a moment [Nm]: one that flexes or one that extends, all others slack."""
        device = self._device
        used = device.lifting_rope if moment > 0.0 else device.lowering_rope
        tensions = [max(moment / device.moment_arm(r, angle), 0.0) if r == used else 0.0 for r in device.ropes]
        return np.clip(2.0 * np.array(tensions) / self._largest - 1.0, -1.0, 1.0)


def gaussians(angle: float) -> np.ndarray:
    """Y at an elbow angle [rad]: shape (n,), sum 1."""
    values = np.exp(-0.5 * ((angle - CENTRES) / WIDTH) ** 2)
    return values / values.sum()

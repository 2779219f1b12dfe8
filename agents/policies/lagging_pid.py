"""The paper's PID with part of its authority, and behind the reference by a constant angle, so that it yields.

The simplest things that a therapist can turn down on a device with a PID. Both are tuned for return on the training
population, see tuning.py; the gains of the PID stay those of `python -m exo_env tune`.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import gymnasium
import numpy as np

from dms_core.renamed import replaced

from .policy import Policy
from .tuned import Range, numbers


class LaggingPid(Policy):
    """PID of constant authority on a setpoint behind the reference.

    Args:
        authority: share of the PID's command that the ropes follow [-].
        lag_deg: by which the setpoint is below the reference [deg].
    """

    name, title, action_mode = "pid_yielding", "PID, yielding", "pid_setpoint"
    ranges: ClassVar[dict[str, Range]] = {"authority": Range(0.02, 1.0, True), "lag_deg": Range(-1.0, 3.0)}

    def __init__(self, **given: float) -> None:
        used = numbers(self.name, self.ranges, given)
        self.authority, self.lag = used["authority"], math.radians(used["lag_deg"])

    def reset(self, env: gymnasium.Env) -> None:
        """The controller's states are in the environment."""
        world: Any = env.unwrapped
        self._range = world.drive.setpoint_range

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """The same action always."""
        return np.array([-self.lag / self._range, 2.0 * self.authority - 1.0])


__getattr__ = replaced(__name__, {"YieldingPid": "It is now LaggingPid."})

"""The paper's PID with compensation of gravity and of the estimated load, through the setpoint.

As compensation.py, but nobody is asked for anything: the arm is an average man's, and the load is what the device's
own filter estimates (exo_env/estimation), anew at each control time. From its sensors a device can hardly tell a load
from a weak arm, so that the estimate stays near a usual load.
"""

from __future__ import annotations

import gymnasium
import numpy as np

from exo_env.ecosystem.arm import Person

from .compensation import ANGLES, CompensatedPid, holding_tensions


class EstimatedLoadPid(CompensatedPid):
    """PID and part of the tension that holds an average arm and the estimated load; numbers as of `CompensatedPid`."""

    name, title = "pid_estimated", "PID with estimated load"
    observation = ("device", "estimated")

    def reset(self, env: gymnasium.Env) -> None:
        """Forget the last patient; holding tensions are straight lines over the load."""
        super().reset(env)
        none, one = (holding_tensions(self._ecosystem, Person(), load, ANGLES) for load in (0.0, 1.0))
        self._own, self._kilogram = none, one - none

    def held(self, observation: np.ndarray) -> np.ndarray:
        """Holding tension of an average arm with the present estimate of the load over ANGLES [N]."""
        return self._own + self._channels.read(observation, "estimated.load") * self._kilogram

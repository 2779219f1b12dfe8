"""Policies to compare with. Each one sees the observation and does no more than its actions allow.

Where device and patient share a reference:

none              both ropes slack; at the start the agonist still holds the arm, and lets go as fast as it can
pid               the paper's PID: the device's own controller, full authority, the reference as its setpoint
pid_yielding      the same with part of the authority, behind the reference by a constant angle, see lagging_pid.py
pid_compensated   such a one with part of the tension that arm, device and load need, see compensation.py
pid_estimated     the same for an average arm and the load that the device estimates, see estimated_load.py
assist_as_needed  learns that tension and forgets it, see assist_as_needed.py

Where the patient's plan is hidden there are `none` and those of the folder reference_free. `oracle` is told the plan.
All but `none` and `pid` have numbers of their own, tuned for return on the training population (tuning.py).
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

from dms_core.errors import InputError, choices

from .assist_as_needed import AssistAsNeeded
from .batch_policy import BatchPolicy, one_world
from .compensation import CompensatedPid
from .estimated_load import EstimatedLoadPid
from .lagging_pid import LaggingPid
from .policy import Policy
from .reference_free.adaptive_gravity import AdaptiveGravity
from .reference_free.admittance import Admittance
from .reference_free.disturbance_observer import DisturbanceObserver
from .reference_free.emg_proportional import EmgProportional
from .reference_free.gravity import Gravity, GravityLoad
from .reference_free.intent_pd import IntentPd
from .reference_free.lack_assist import LackAssist
from .reference_free.mean_movement import MeanAngle, MeanClock
from .reference_free.onset import Onset
from .reference_free.oracle import Oracle, SoftOracle


class NoAssistance(BatchPolicy):
    """Both ropes slack."""

    name, title, action_mode = "none", "no assistance", "rope_tension"

    def begin(self, env: gymnasium.Env | VectorEnv, n: int) -> None:
        """How many ropes there are."""
        (self._ropes,) = one_world(env).action_space.shape

    def act(self, observations: np.ndarray) -> np.ndarray:
        """Commands of no tension."""
        return np.full((len(observations), self._ropes), -1.0)


class PidControl(Policy):
    """The paper's PID, with the gains of `python -m exo_env tune`."""

    name, title, action_mode = "pid", "PID", "pid_setpoint"

    def reset(self, env: gymnasium.Env) -> None:
        """The controller's states are in the environment."""

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """No setpoint change, all authority."""
        return np.array([0.0, 1.0])


FOLLOWING: dict[str, type[Policy]] = {
    p.name: p for p in (NoAssistance, PidControl, LaggingPid, CompensatedPid, EstimatedLoadPid, AssistAsNeeded)
}
"""Policies for tasks whose reference is shown."""
REFERENCE_FREE: dict[str, type[BatchPolicy]] = {
    p.name: p
    for p in (
        NoAssistance, Gravity, GravityLoad, EmgProportional, Admittance, AdaptiveGravity, Onset, DisturbanceObserver,
        LackAssist, IntentPd, MeanClock, MeanAngle, Oracle, SoftOracle,
    )
}  # fmt: skip
"""Policies for tasks whose plan is hidden, with the oracle."""
POLICIES: dict[str, type[Policy]] = {**FOLLOWING, **REFERENCE_FREE}


def policy(name: str) -> Policy:
    """A policy by name.

    Raises:
        InputError: there is none of this name; lists those there are.
    """
    if name not in POLICIES:
        raise InputError(f"unknown policy '{name}'. There are: {choices(POLICIES)}.")
    return POLICIES[name]()

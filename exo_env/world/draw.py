"""What is drawn at random for one episode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Draw:
    """What is drawn at random for an episode."""

    key: int
    """Key of the random streams (streams.py), which the noise of the episode comes from."""
    patient: np.ndarray
    """Row of the patient, in the order of FIELDS."""
    load: float
    """Weight on the machine [kg]."""
    movement: np.ndarray
    """Numbers of the movement, with those that the episode fixes."""
    task: np.ndarray
    """Numbers that the task draws, in the order of `Task.draws`."""
    start: float
    """Elbow angle at the start [rad]."""
    phase: float
    """Phase of the tremor at the start [rad]."""

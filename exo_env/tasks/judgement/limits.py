"""What ends an episode early: limits of anatomy and of safety.

An elbow rests against its stops at 0 and 142 deg (configs/subject/arm26.yaml): a straight arm is no event, one that is
pressed far beyond a stop is. At 5 deg beyond, the stop of arm26 holds 103 Nm, twice what its muscles can, and an arm
that falls straight with 2 kg goes less than 3 deg into it, whether the ropes are slack or pull it down.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from exo_env.settings import Settings
from exo_env.tasks.task import FIRST_EVENT, NOTHING

EVENTS = ("angle", "tension", "reaction")
"""Names of what ends an episode early, in the order of their codes."""
ANGLE, TENSION, REACTION = range(FIRST_EVENT, FIRST_EVENT + len(EVENTS))


class Limits(Settings):
    """Limits beyond which an episode is over."""

    lowest_deg: float = Field(
        default=-5.0, ge=-10.0, le=90.0, description="elbow angle [deg]; assumed: 5 deg beyond a straight arm"
    )
    highest_deg: float = Field(
        default=147.0,
        ge=10.0,
        le=160.0,
        description="elbow angle [deg]; assumed: 5 deg beyond men's mean active flexion",
    )
    tension: float = Field(default=1000.0, gt=0.0, description="of a rope [N]; assumed: two thirds of the motor's most")
    reaction: float = Field(
        default=2500.0, gt=0.0, description="elbow reaction force [N]; assumed: about three times body weight"
    )

    @model_validator(mode="after")
    def _ordered(self):
        if self.lowest_deg >= self.highest_deg:
            raise ValueError(f"lowest_deg = {self.lowest_deg} must be below highest_deg = {self.highest_deg}")
        return self

    def numbers(self) -> np.ndarray:
        """Limits for compiled code: angles [rad], tension and reaction [N], shape (4,)."""
        return np.array([math.radians(self.lowest_deg), math.radians(self.highest_deg), self.tension, self.reaction])


@compiled
def exceeded(limits, angle, tensions, reaction):
    """Code of the limit that is exceeded, or NOTHING.

    Args:
        limits: numbers of `Limits.numbers`.
        angle: angle of the elbow [rad].
        tensions: tensions of the ropes [N], shape (n,).
        reaction: size of the elbow's reaction force [N].
    """
    if not limits[0] <= angle <= limits[1]:
        return ANGLE
    for i in range(tensions.shape[0]):
        if not tensions[i] <= limits[2]:
            return TENSION
    return NOTHING if reaction <= limits[3] else REACTION


def limit_sentence(event: str, limits: Limits, angle: float, tension: float, reaction: float) -> str:
    """The sentence on a limit that was passed.

    Args:
        event: one of EVENTS.
        limits: limits of this environment.
        angle: angle of the elbow [rad].
        tension: largest tension of all ropes [N].
        reaction: size of the elbow's reaction force [N].
    """
    if event == "angle":
        low, high = limits.lowest_deg, limits.highest_deg
        return f"The elbow is at {math.degrees(angle):.2f} deg, outside {low:g} to {high:g} deg."
    if event == "tension":
        return f"A rope pulls with {tension:.0f} N; {limits.tension:g} N is the limit."
    return f"The elbow's reaction force is {reaction:.0f} N; {limits.reaction:g} N is the limit."

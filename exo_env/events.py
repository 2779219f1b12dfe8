"""What ends an episode early: limits of anatomy and of safety."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from pydantic import Field, model_validator

from exo_env.settings import Settings


class Limits(Settings):
    """Beyond these an episode is over."""

    lowest_deg: float = Field(
        default=0.0, ge=-10.0, le=90.0, description="elbow angle [deg]; a straight arm, where the elbow's bones meet"
    )
    highest_deg: float = Field(
        default=142.0, ge=10.0, le=160.0,
        description="elbow angle [deg]; mean active flexion of men (Boone and Azen 1979, J. Bone Joint Surg. 61:756)",
    )  # fmt: skip
    tension: float = Field(default=1000.0, gt=0.0, description="of a rope [N]; assumed: two thirds of the motor's most")
    reaction: float = Field(
        default=2500.0, gt=0.0, description="elbow reaction force [N]; assumed: about three times body weight"
    )

    @model_validator(mode="after")
    def _ordered(self):
        if self.lowest_deg >= self.highest_deg:
            raise ValueError(f"lowest_deg = {self.lowest_deg} must be below highest_deg = {self.highest_deg}")
        return self


def event(limits: Limits, angle: float, tensions: Sequence[float] | np.ndarray, reaction: float) -> str | None:
    """A sentence on the limit that is exceeded, or None.

    Args:
        limits: of this environment.
        angle: of the elbow [rad].
        tensions: of both ropes [N].
        reaction: size of the elbow's reaction force [N].
    """
    degrees = math.degrees(angle)
    if not limits.lowest_deg <= degrees <= limits.highest_deg:
        return f"The elbow is at {degrees:.1f} deg, outside {limits.lowest_deg:g} to {limits.highest_deg:g} deg."
    if max(tensions) > limits.tension:
        return f"A rope pulls with {max(tensions):.0f} N; {limits.tension:g} N is the limit."
    if reaction > limits.reaction:
        return f"The elbow's reaction force is {reaction:.0f} N; {limits.reaction:g} N is the limit."
    return None

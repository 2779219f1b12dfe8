"""A task without a reference: keep the arm still, with little tension, whoever it is."""

import math
from typing import ClassVar

import numpy as np
from pydantic import Field

from exo_env.kernels import (
    FIRST_EVENT,
    NOTHING,
    compiled,
    end_with,
    event_of,
    first_of,
    places,
    readings,
    task_numbers,
    terms_of,
)
from exo_env.settings import Settings
from exo_env.tasks.elbow import ELBOW, action_channel, device_channels, elbow_readings, read_elbow
from exo_env.tasks.movements.movement import Movement, Stay
from exo_env.tasks.observation.channels import Channel, Reading
from exo_env.tasks.task import Reported, Task


class Weights(Settings):
    """Weights of the two terms."""

    stillness: float = Field(default=1.0, ge=0.0)
    quiet: float = Field(default=0.1, ge=0.0)


class Limits(Settings):
    """Beyond which an episode is over."""

    rate: float = Field(default=8.0, gt=0.0, description="of the elbow [rad/s]")

    def numbers(self) -> np.ndarray:
        return np.array([self.rate])


TERM = places(Weights.model_fields)


@compiled
def read(w):
    """Those of the elbow, and the sum of all tensions."""
    read_elbow(w)
    r, at = readings(w), first_of(w)
    total = 0.0
    for i in range(at[ELBOW.tension], at[ELBOW.tension + 1]):
        total += r[i]
    r[at[len(ELBOW)]] = total


@compiled
def judge(w):
    """1 for an arm at rest, less for tension."""
    r, at, terms = readings(w), first_of(w), terms_of(w)
    rate = r[at[ELBOW.rate]]
    if event_of(w) == NOTHING and abs(rate) > task_numbers(w)[0]:
        end_with(w, FIRST_EVENT)
    terms[TERM.stillness] = math.exp(-(rate**2))
    terms[TERM.quiet] = -r[at[len(ELBOW)]] / 100.0


class HoldStill(Task):
    """Keep still."""

    weights_type: ClassVar = Weights
    limits_type: ClassVar = Limits
    movement_type: ClassVar[type[Movement]] = Stay
    events: ClassVar = ("too_fast",)
    reported: ClassVar = (Reported("total_tension", "total_tension"),)
    read, judge = read, judge

    def declared_readings(self, parts):
        return [*elbow_readings(parts), Reading("total_tension", "N")]

    def declared_groups(self, parts):
        return {
            "device": [*device_channels(), action_channel()],
            "sum": [Channel("total_tension", 100.0, 0.0, 3000.0), Channel("angle", 1.0, -0.5, 3.0, reading="hinge")],
        }

    def sentence(self, event, values):
        return f"The elbow turns at {values('rate')[0]:.1f} rad/s, faster than {self.limits.rate:g}."

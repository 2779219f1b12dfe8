"""The task of exo/ElbowLift: lift a weight along a reference that patient and device both know."""

from __future__ import annotations

import math
from typing import ClassVar

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner, matrix
from exo_env.places import places
from exo_env.settings import Settings
from exo_env.tables import DRIVE, PLAN, WORLD
from exo_env.tasks.channels import Channel, Parts, Reading
from exo_env.tasks.checked import begins
from exo_env.tasks.elbow import (
    ELBOW,
    action_channel,
    device_channels,
    elbow_readings,
    emg_channels,
    lacking_of,
    privileged_channels,
    read_elbow,
)
from exo_env.tasks.limits import EVENTS, Limits, exceeded, limit_sentence
from exo_env.tasks.movement import Movement
from exo_env.tasks.repetition import Repetitions
from exo_env.tasks.rewards import Weights, term_values
from exo_env.tasks.task import (
    NOTHING,
    Reported,
    Task,
    Values,
    end_with,
    event_of,
    first_of,
    readings,
    step_of,
    task_numbers,
    terms_of,
)

PREVIEW = (0.1, 0.2, 0.4)
"""How far ahead the reference is shown [s]; assumed."""


def lift_readings(parts: Parts) -> list[Reading]:
    """The readings of every elbow task, and the reference some time ahead."""
    return [*elbow_readings(parts), Reading("preview", "rad", tuple(f"in {t} s" for t in PREVIEW))]


LIFT = places(reading.name for reading in lift_readings(Parts((), (), ())))
"""Place of each reading in the list of `lift_readings`."""
begins(LIFT, lift_readings)


@compiled
def _read(w):
    """Fill the readings of every elbow task, and the preview."""
    read_elbow(w)
    r, at, preview, k = readings(w), first_of(w), matrix(inner(w, WORLD.plan), PLAN.preview), step_of(w)
    for i in range(preview.shape[1]):
        r[at[LIFT.preview] + i] = preview[k, i]


@compiled
def _judge(w):
    """Check the limits, then fill the reward terms of rewards.py."""
    r, at, plan, drive = readings(w), first_of(w), inner(w, WORLD.plan), inner(w, WORLD.drive)
    reaction = r[at[ELBOW.reaction]]
    tensions = r[at[ELBOW.tension] : at[ELBOW.muscle_moment]]
    if event_of(w) == NOTHING:
        end_with(w, exceeded(task_numbers(w), r[at[ELBOW.angle]], tensions, reaction))
    term_values(
        r[at[ELBOW.error]], r[at[ELBOW.exo_moment]], lacking_of(w),
        floats(plan, PLAN.scale)[0], reaction, floats(drive, DRIVE.action), floats(drive, DRIVE.before),
        event_of(w) != NOTHING, terms_of(w),
    )  # fmt: skip


class LiftTask(Task):
    """The task: follow the reference, and let the patient do what the patient can."""

    weights_type: ClassVar[type[Settings]] = Weights
    limits_type: ClassVar[type[Settings]] = Limits
    movement_type: ClassVar[type[Movement]] = Repetitions
    limits: Limits
    events: ClassVar[tuple[str, ...]] = EVENTS
    preview: ClassVar[tuple[float, ...]] = PREVIEW
    reported: ClassVar[tuple[Reported, ...]] = (
        Reported("tracking_error_deg", "error", 180.0 / math.pi),
        Reported("device_share", "device_share"),
        Reported("effort", "effort"),
        Reported("elbow_reaction", "reaction"),
    )
    read, judge = _read, _judge

    def declared_readings(self, parts: Parts) -> list[Reading]:
        """The readings of `lift_readings`."""
        return lift_readings(parts)

    def declared_groups(self, parts: Parts) -> dict[str, list[Channel]]:
        """Three groups: what a device measures, with the reference; EMG; and what only a simulation knows."""
        reference = [
            Channel("reference", 1.0, -0.5, 3.0),
            Channel("reference_rate", 1.0, -20.0, 20.0),
            Channel("preview", 1.0, -0.5, 3.0),
        ]
        return {
            "device": [*device_channels(), *reference, action_channel()],
            "emg": emg_channels(),
            "privileged": privileged_channels(),
        }

    def start_range(self) -> tuple[float, float]:
        """The limits of the elbow [deg]."""
        return self.limits.lowest_deg, self.limits.highest_deg

    def sentence(self, event: str, values: Values) -> str:
        """A sentence on the limit that was passed."""
        angle, reaction = float(values("angle")[0]), float(values("reaction")[0])
        return limit_sentence(event, self.limits, angle, float(values("tension").max()), reaction)

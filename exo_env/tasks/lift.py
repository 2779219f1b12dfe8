"""The task of exo/ElbowLift: lift a weight along a reference that patient and device both know."""

from __future__ import annotations

import math
from typing import ClassVar

from dms_core.compiled.jit import compiled
from exo_env.places import places
from exo_env.settings import Settings
from exo_env.tasks.checked import begins
from exo_env.tasks.elbow import (
    action_channel,
    device_channels,
    elbow_readings,
    emg_channels,
    privileged_channels,
    read_elbow,
)
from exo_env.tasks.elbow_task import PREVIEW, ElbowTask, judge_elbow, put_preview
from exo_env.tasks.judgement.rewards import TRACKING_WIDTH, Weights
from exo_env.tasks.movements.movement import Movement
from exo_env.tasks.movements.repetition import Repetitions
from exo_env.tasks.observation.channels import Channel, Parts, Reading
from exo_env.tasks.observation.estimates import estimated_channels, estimated_readings
from exo_env.tasks.task import Reported, first_of


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
    put_preview(w, first_of(w)[LIFT.preview])


@compiled
def _judge(w):
    """Check the limits, and fill the reward terms of rewards.py."""
    judge_elbow(w, TRACKING_WIDTH)


class LiftTask(ElbowTask):
    """The task: follow the reference, and let the patient do what the patient can."""

    weights_type: ClassVar[type[Settings]] = Weights
    movement_type: ClassVar[type[Movement]] = Repetitions
    reported: ClassVar[tuple[Reported, ...]] = (
        Reported("tracking_error_deg", "error", 180.0 / math.pi),
        Reported("device_share", "device_share"),
        Reported("effort", "effort"),
        Reported("elbow_reaction", "reaction"),
    )
    read, judge = _read, _judge

    def declared_readings(self, parts: Parts) -> list[Reading]:
        """The readings of `lift_readings`, and what the device's filter estimates."""
        return [*lift_readings(parts), *estimated_readings()]

    def declared_groups(self, parts: Parts) -> dict[str, list[Channel]]:
        """What a device measures, with the reference; what it estimates; EMG; and what only a simulation knows."""
        reference = [
            Channel("reference", 1.0, -0.5, 3.0),
            Channel("reference_rate", 1.0, -20.0, 20.0),
            Channel("preview", 1.0, -0.5, 3.0),
        ]
        return {
            "device": [*device_channels(), *reference, action_channel()],
            "estimated": estimated_channels(),
            "emg": emg_channels(),
            "privileged": privileged_channels(),
        }

"""The task of exo/HiddenIntent: help a patient who moves where and when he likes, which nothing tells the device."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from dms_core.compiled.jit import compiled
from dms_core.errors import choices
from dms_core.kernels import floats, inner, matrix
from exo_env.ecosystem.sensors import FOREARM_IMU
from exo_env.patient.distributions import Distribution
from exo_env.places import places
from exo_env.settings import Settings, given_mapping
from exo_env.tables import DRAW, PLAN, WORLD
from exo_env.tasks.checked import begins
from exo_env.tasks.elbow import (
    ELBOW,
    action_channel,
    device_channels,
    elbow_readings,
    lacking_of,
    privileged_channels,
    read_elbow,
)
from exo_env.tasks.elbow_task import PREVIEW, ElbowTask, judge_elbow, put_preview
from exo_env.tasks.judgement.intent_rewards import INTENT_TERM, INTENT_WIDTH, IntentWeights, opposing_power, opposition
from exo_env.tasks.movements.intentions import Intentions
from exo_env.tasks.movements.movement import Movement
from exo_env.tasks.observation.channels import Channel, Imperfection, Parts, Reading
from exo_env.tasks.observation.electrodes import Electrodes, electrode_draws, put_envelopes
from exo_env.tasks.observation.estimates import estimated_channels, estimated_readings
from exo_env.tasks.task import Reported, first_of, readings, step_of, terms_of

EPISODES_RENEWED = 0.1
"""Share of the episodes in which electrodes are put on anew; assumed."""


def intent_readings(parts: Parts) -> list[Reading]:
    """The readings of every elbow task, what the electrodes and the inertial sensor show, and the patient's plan."""
    force = tuple(f"{FOREARM_IMU}.specific_force.{x}" for x in "xy")
    return [
        *elbow_readings(parts),
        Reading("gyro", "rad/s", sensors=(f"{FOREARM_IMU}.angular_velocity.z",)),
        Reading("specific_force", "m/s^2", ("x", "y"), sensors=force),
        Reading("emg", "-", parts.muscles),
        Reading("intent_acceleration", "rad/s^2"),
        Reading("preview", "rad", tuple(f"in {t} s" for t in PREVIEW)),
        Reading("needed_moment", "Nm"),
        Reading("lacking_moment", "Nm"),
        Reading("opposing_power", "W"),
        Reading("clock", "s"),
    ]


INTENT = places(reading.name for reading in intent_readings(Parts((), (), ())))
"""Place of each reading in the list of `intent_readings`."""
begins(INTENT, intent_readings)


@compiled
def read_intent(w):
    """Fill the readings of `intent_readings` that no sensor gives."""
    read_elbow(w)
    r, at, plan, k = readings(w), first_of(w), inner(w, WORLD.plan), step_of(w)
    course = matrix(plan, PLAN.course)
    put_preview(w, at[INTENT.preview])
    m = at[INTENT.reaction] - at[INTENT.activation]
    put_envelopes(
        r[at[INTENT.activation] : at[INTENT.activation] + m], floats(inner(w, WORLD.draw), DRAW.task),
        k / (course.shape[0] - 1), r[at[INTENT.emg] : at[INTENT.emg] + m],
    )  # fmt: skip
    needed = floats(plan, PLAN.needed)[k]
    r[at[INTENT.intent_acceleration]], r[at[INTENT.needed_moment]] = course[k, 2], needed
    r[at[INTENT.lacking_moment]] = lacking_of(w)
    r[at[INTENT.opposing_power]] = opposing_power(r[at[ELBOW.exo_moment]], needed, course[k, 1])
    r[at[INTENT.clock]] = k * floats(w, WORLD.period)[0]


@compiled
def judge_intent(w):
    """Check the limits, then fill the reward terms of intent_rewards.py."""
    judge_elbow(w, INTENT_WIDTH)
    power = readings(w)[first_of(w)[INTENT.opposing_power]]
    terms_of(w)[INTENT_TERM.opposition] = opposition(power, floats(inner(w, WORLD.plan), PLAN.scale)[0])


class HiddenIntentTask(ElbowTask):
    """The task: help the patient to where the patient wants, as much as is needed, against nobody.

    Args:
        parts: names of what the ecosystem and the drive have.
        weights: changes of the terms' weights.
        limits: changes of the limits.
        electrodes: changes of what may be wrong with the electrodes.

    Raises:
        InputError: one of these is not possible.
    """

    weights_type: ClassVar[type[Settings]] = IntentWeights
    movement_type: ClassVar[type[Movement]] = Intentions
    # A worn device does not know when an episode began; the clock is there to measure what that would be worth.
    revealing: ClassVar[tuple[str, ...]] = ("privileged", "clock")
    reported: ClassVar[tuple[Reported, ...]] = (
        Reported("tracking_error_deg", "error", 180.0 / math.pi),
        Reported("device_share", "device_share"),
        Reported("effort", "effort"),
        Reported("elbow_reaction", "reaction"),
        Reported("opposing_power", "opposing_power"),
    )
    read, judge = read_intent, judge_intent

    def __init__(
        self,
        parts: Parts,
        weights: Mapping[str, float] | None = None,
        limits: Mapping[str, float] | None = None,
        electrodes: Mapping[str, float] | None = None,
    ) -> None:
        given = given_mapping("electrodes", electrodes, f"some of {choices(Electrodes.model_fields)}, or None")
        self.electrodes = Electrodes(**given)
        super().__init__(parts, weights, limits)

    def declared_readings(self, parts: Parts) -> list[Reading]:
        """The readings of `intent_readings`, and what the device's filter estimates."""
        return [*intent_readings(parts), *estimated_readings()]

    def declared_groups(self, parts: Parts) -> dict[str, list[Channel]]:
        """What a device measures, without reference or clock, and estimates; EMG; inertial sensor; truth; a clock.

        Noise of the inertial sensor on the wrist is assumed: a consumer sensor behind a filter of 20 Hz.
        """
        plan = [
            Channel("elbow", 1.0, -0.5, 3.0, reading="angle"),
            Channel("elbow_rate", 1.0, -20.0, 20.0, reading="rate"),
            Channel("activation", 1.0, 0.0, 1.0),
            Channel("intent", 1.0, -0.5, 3.0, reading="reference"),
            Channel("intent_rate", 1.0, -20.0, 20.0, reading="reference_rate"),
            Channel("intent_acceleration", 10.0, -500.0, 500.0),
            Channel("preview", 1.0, -0.5, 3.0),
            Channel("needed_moment", 10.0, -500.0, 500.0),
            Channel("lacking_moment", 10.0, -500.0, 500.0),
        ]
        return {
            "device": [*device_channels(), action_channel()],
            "estimated": estimated_channels(),
            "emg": [Channel("emg", 1.0, 0.0, 2.0, Imperfection(deviation=0.03, delay=0.02))],
            "imu": [
                Channel("gyro", 1.0, -20.0, 20.0, Imperfection(deviation=0.02)),
                Channel("specific_force", 10.0, -200.0, 200.0, Imperfection(deviation=0.2)),
            ],
            "privileged": [*privileged_channels(), *plan],
            "clock": [Channel("clock", 10.0, 0.0, 200.0)],
        }

    def draws(self) -> Mapping[str, Distribution]:
        """What goes wrong with the electrodes in an episode."""
        return electrode_draws(self.parts.muscles, self.renewed(), self.electrodes)

    def renewed(self) -> object:
        """Distribution of the part of the episode after which electrodes are put on anew; above 1 for never."""
        return {"uniform": [0.0, 1.0 / EPISODES_RENEWED]}


class NewPatientTask(HiddenIntentTask):
    """The same with one patient for long; electrodes are put on anew in the middle."""

    def renewed(self) -> object:
        """In the middle of the episode."""
        return 0.5

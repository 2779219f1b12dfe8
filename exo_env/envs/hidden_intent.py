"""The environments exo/HiddenIntent-v0 and exo/NewPatient-v0."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field

from dms_core.errors import InputError
from exo_env.drives.drive import Drive
from exo_env.drives.modes import WITHOUT_REFERENCE
from exo_env.envs.base_env import AssistanceEnv
from exo_env.envs.settings import EnvSettings, check_whole
from exo_env.envs.vector_env import AssistanceVectorEnv
from exo_env.tasks.hidden_intent import HiddenIntentTask, NewPatientTask
from exo_env.tasks.movements.intentions import Intentions
from exo_env.tasks.movements.movement import Movement
from exo_env.tasks.movements.repetition import MOST_REPETITIONS
from exo_env.tasks.observation.channels import Parts
from exo_env.tasks.task import Task

TIME = 9.0
"""Length of a window of the plan [s]."""


class HiddenIntentSettings(EnvSettings):
    """The arguments of exo/HiddenIntent-v0."""

    action_mode: str = Field(default="assist_moment", description="drive, by name")
    repetitions: Any = Field(default=1, description="number of windows in an episode, each with a plan of its own")
    electrodes: Any = Field(default=None, description="changes of what may be wrong with the electrodes")


class NewPatientSettings(HiddenIntentSettings):
    """The arguments of exo/NewPatient-v0."""

    repetitions: Any = Field(default=8, description="number of windows in an episode, each with a plan of its own")


class HiddenIntentEnv(AssistanceEnv):
    """Assist a patient who moves where and when he likes.

    ## Description
    Arm, exoskeleton and weight are those of `exo/ElbowLift`, but nobody tells the device what the patient wants. The
    patient goes to two to four targets of his own choice at times of his own choice, breaks some moves off or goes
    elsewhere on the way, and now and then picks something up or puts it down. The device feels its own hinge, its ropes
    and the force in its cuff; with more groups of observations also the muscles, or the forearm's inertial sensor. It
    has to find out what is wanted, who is in it and what is carried, and to help as much as is needed and against
    nobody. The plan is in `info` and in the group "privileged", for teachers and for judges.

    ## Action Space
    `Box(-1, 1, (2,), float32)` with `action_mode="assist_moment"`, the default: a moment about the hinge, which the
    device's own moment arms turn into tensions, and a co-tension:

    | Num | Action     | Min | Max | Control Min | Control Max | Unit |
    |-----|------------|-----|-----|-------------|-------------|------|
    | 0   | moment     | -1  | 1   | -15         | 15          | Nm   |
    | 1   | co-tension | -1  | 1   | 0           | 40          | N    |

    "rope_tension" and "impedance" are those of `exo/ElbowLift`. Its "pid_setpoint" needs a reference that the
    device knows, and there is none.

    ## Observation Space
    `Box`, float32, of the groups in `observation`. An observation times its scale is the reading in its unit; least and
    greatest are those of observations. Angles and moments are positive where they flex the elbow; the device's moment
    on it counts alike. "device", the default, has no reference and no clock:

    | Num | Observation           | Min  | Max | Unit  | Scale |
    |-----|-----------------------|------|-----|-------|-------|
    | 0   | angle                 | -0.5 | 3   | rad   | 1     |
    | 1   | rate                  | -20  | 20  | rad/s | 1     |
    | 2   | tension, agonist      | 0    | 16  | N     | 100   |
    | 3   | tension, antagonist   | 0    | 16  | N     | 100   |
    | 4   | guide_force           | -50  | 50  | N     | 10    |
    | 5   | last_action, first    | -1   | 1   | -     | 1     |
    | 6   | last_action, second   | -1   | 1   | -     | 1     |

    "estimated" is what a Kalman filter in the device makes of angle, rate and guide force: the moment of all but the
    device, that of the muscles, the intended one, load and effort, each followed by its standard deviation
    (`exo_env/tasks/observation/estimates.py`; `env.unwrapped.summary()` tells places and scales). It cannot tell
    muscles from load, and says so; its effort is a share of an average man's strength and not the patient's will, which
    `info["effort"]` is. "emg" has six
    envelopes with unknown gains, crosstalk, delay, noise, channels that drop out and electrodes that are
    put on anew (`exo_env/tasks/observation/electrodes.py`); "imu" the forearm's rate and specific force; "privileged"
    the patient's traits, true states and the plan; "clock" the time since the episode began, which no worn device knows
    and only an ablation may see. Groups and single channels ("emg.emg") are composed by name.

    ## Rewards
    The sum of six terms times their weights (`exo_env/tasks/judgement/intent_rewards.py` gives reasons and sources).

    | Term       | Value                                                                      | Weight |
    |------------|----------------------------------------------------------------------------|--------|
    | tracking   | exp(-(angle from what the patient wants / 10 deg)^2)                       | 1      |
    | assistance | -(moment of the device beyond need) / need, at least -2                    | 0.75   |
    | smoothness | -mean square change of the action / 4                                      | 0.2    |
    | reaction   | -(elbow reaction / 500 N - 1) beyond 500 N, at least -2                    | 0.2    |
    | unsafe     | -1 where an event ends the episode                                         | 100    |
    | opposition | -(power of the device against the move) / (need 1 rad/s), at least -2      | 0.5    |

    ## Starting State
    At rest at the first angle of the plan, muscles as the patient's command wants them; the agonist holds what they do
    not. Everything is drawn as in `exo/ElbowLift`, each number from a random stream of its own. `reset(options={...})`
    fixes any of `patient`, `load` [kg], `reference` (distributions of the plan) and `initial_angle_deg`.

    ## Episode End
    As in `exo/ElbowLift`; truncated after `episode_duration` (9 s), or as long for each of several `repetitions`.

    ## Arguments
    Those of `exo/ElbowLift`, with another default of `action_mode`; `reference` are the distributions of `Intentions`
    (`exo_env/tasks/movements/intentions.py`): start_deg, rest, targets, amplitude_deg, duration, pause, picked_up, and
    the shares changes_of_mind and load_changes. `electrodes` says how much may be wrong with the electrodes:
    gain_deviation (0.3), crosstalk (at most 0.2) and dropping (0.2, the share of the episodes in which a channel drops
    out). With `repetitions` the patient has a plan in each of several windows of `episode_duration / repetitions`;
    `exo/NewPatient-v0` has 8 of them with one patient: fatigue goes on, the load changes, and electrodes are put on
    anew midway.

    ## Version History
    * v0: first version. Since 0.3.0 the width of the tracking term is 10 deg (5 before) and patients hold more stiffly
      under load; returns before and after cannot be compared.
    """

    task_type: ClassVar[type[Task]] = HiddenIntentTask
    settings_type: ClassVar[type[EnvSettings]] = HiddenIntentSettings
    drives: ClassVar[Mapping[str, type[Drive]]] = WITHOUT_REFERENCE
    settings: HiddenIntentSettings

    def usual_duration(self, settings: EnvSettings) -> float:
        """Length of an episode where the settings name none: nine seconds a window [s]."""
        assert isinstance(settings, HiddenIntentSettings)
        check_whole("repetitions", settings.repetitions, MOST_REPETITIONS)
        return TIME * settings.repetitions

    def made_task(self, settings: EnvSettings, parts: Parts) -> Task:
        """The task, with its weights, limits and electrodes as the settings change them."""
        assert isinstance(settings, HiddenIntentSettings) and issubclass(self.task_type, HiddenIntentTask)
        return self.task_type(parts, settings.reward_weights, settings.limits, settings.electrodes)

    def made_movement(self, reference: Any) -> Movement:
        """Plans in as many windows as the settings say."""
        check_whole("repetitions", self.settings.repetitions, MOST_REPETITIONS)
        return Intentions.of(reference).in_windows(self.settings.repetitions)

    def _made_drive(self, settings: EnvSettings) -> Drive:
        """The drive of the action mode.

        Raises:
            InputError: the mode needs a reference that the device knows.
        """
        if settings.action_mode == "pid_setpoint":
            raise InputError(
                "action_mode = 'pid_setpoint' follows a reference that the device knows, and here the patient's plan "
                f"is hidden: expected one of {', '.join(self.drives)}."
            )
        return super()._made_drive(settings)


class HiddenIntentVectorEnv(AssistanceVectorEnv):
    """Many HiddenIntentEnv in one compiled batch; see AssistanceVectorEnv."""

    env_type: ClassVar[type[AssistanceEnv]] = HiddenIntentEnv


class NewPatientEnv(HiddenIntentEnv):
    """Assist one patient for 72 s, in eight windows with a plan each; see HiddenIntentEnv."""

    task_type: ClassVar[type[Task]] = NewPatientTask
    settings_type: ClassVar[type[EnvSettings]] = NewPatientSettings


class NewPatientVectorEnv(AssistanceVectorEnv):
    """Many NewPatientEnv in one compiled batch; see AssistanceVectorEnv."""

    env_type: ClassVar[type[AssistanceEnv]] = NewPatientEnv

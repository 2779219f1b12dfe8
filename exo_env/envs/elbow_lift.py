"""The environment exo/ElbowLift-v2."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from exo_env.envs.base_env import AssistanceEnv
from exo_env.envs.settings import EnvSettings, check_whole
from exo_env.envs.vector_env import AssistanceVectorEnv
from exo_env.tasks.lift import LiftTask
from exo_env.tasks.movements.movement import Movement
from exo_env.tasks.movements.repetition import MOST_REPETITIONS, Repetitions
from exo_env.tasks.task import Task

TIME = 6.0
"""Length of an episode of one repetition [s]."""


class ElbowLiftSettings(EnvSettings):
    """The arguments of exo/ElbowLift-v2."""

    repetitions: Any = Field(default=1, description="number of repetitions in an episode")


class ElbowLiftEnv(AssistanceEnv):
    """Assist a patient who lifts a weight by bending the elbow.

    ## Description
    A subject with six elbow muscles wears a cable-driven elbow exoskeleton and lifts a weight on a gym machine along a
    reference (Fig. 8 of the paper, scenario 3). Bodies, joints, ropes, muscles, motors and controller are one system of
    differential-algebraic equations that advances with its own steps; one `step` is one control period (50 Hz). Over
    it, commands and the patient's excitations go linearly from their last values to the new ones. One episode is one
    repetition: rest, flexion, pause, return, of random amplitude, duration and pause, with a random patient and load.
    With `repetitions` it is done several times, while fatigue and effort go on. The patient is to do as much as
    possible, the device no more than is needed: effort is forgotten where the device leaves no error.

    ## Action Space
    `Box(-1, 1, (2,), float32)`, or three numbers for "impedance". Numbers beyond -1 to 1 are clipped; a number that is
    not finite, or another shape, is an error. An action says what the commands are at the end of its control period.
    With `action_mode="rope_tension"` (the default) these are tensions, which change by at most 2000 N/s and follow with
    a lag of 0.02 s:

    | Num | Action             | Min | Max | Control Min | Control Max | Unit |
    |-----|--------------------|-----|-----|-------------|-------------|------|
    | 0   | agonist tension    | -1  | 1   | 0           | 200         | N    |
    | 1   | antagonist tension | -1  | 1   | 0           | 100         | N    |

    With `action_mode="pid_setpoint"` the device's own PID holds the reference plus a setpoint change, which passes a
    critically damped second-order filter of 20 rad/s; its authority changes by at most 10 1/s:

    | Num | Action             | Min | Max | Control Min | Control Max | Unit |
    |-----|--------------------|-----|-----|-------------|-------------|------|
    | 0   | setpoint change    | -1  | 1   | -0.2        | 0.2         | rad  |
    | 1   | authority          | -1  | 1   | 0           | 1           | -    |

    With `action_mode="assist_moment"` it is a moment about the device's hinge and a co-tension, the mean tension of
    both ropes beside it. The device's moment arms at the measured angle make tensions of them, which stay within those
    above and follow in the same way:

    | Num | Action             | Min | Max | Control Min | Control Max | Unit |
    |-----|--------------------|-----|-----|-------------|-------------|------|
    | 0   | moment             | -1  | 1   | -15         | 15          | Nm   |
    | 1   | co-tension         | -1  | 1   | 0           | 40          | N    |

    With `action_mode="impedance"` the device is compliant: a spring, whose zero follows the hinge with a time constant
    of 0.1 s, a damper, and a share of the moment that holds an average arm and the device's link; the motors follow
    this law with a lag of 0.02 s. Each number changes by at most 10 times its largest value in a second:

    | Num | Action             | Min | Max | Control Min | Control Max | Unit      |
    |-----|--------------------|-----|-----|-------------|-------------|-----------|
    | 0   | stiffness          | -1  | 1   | 0           | 30          | Nm/rad    |
    | 1   | damping            | -1  | 1   | 0           | 3           | N m s/rad |
    | 2   | gravity share      | -1  | 1   | 0           | 4           | -         |

    ## Observation Space
    `Box`, float32, of the groups in `observation`: "device" (the default) is what a worn exoskeleton can measure,
    "estimated" what a Kalman filter in it makes of that (moments, load and effort, each with its standard deviation:
    `exo_env/tasks/observation/estimates.py`), "emg" noisy activations, "privileged" the patient's parameters and true
    muscle forces. An observation times its scale is the reading in its unit; `env.unwrapped.observation_structure` says
    the same of every group. Of "device":

    | Num | Observation                   | Min  | Max | Unit  | Scale |
    |-----|-------------------------------|------|-----|-------|-------|
    | 0   | angle                         | -0.5 | 3   | rad   | 1     |
    | 1   | rate                          | -20  | 20  | rad/s | 1     |
    | 2   | tension, agonist              | 0    | 16  | N     | 100   |
    | 3   | tension, antagonist           | 0    | 16  | N     | 100   |
    | 4   | guide_force                   | -50  | 50  | N     | 10    |
    | 5   | reference                     | -0.5 | 3   | rad   | 1     |
    | 6   | reference_rate                | -20  | 20  | rad/s | 1     |
    | 7   | preview, in 0.1 s             | -0.5 | 3   | rad   | 1     |
    | 8   | preview, in 0.2 s             | -0.5 | 3   | rad   | 1     |
    | 9   | preview, in 0.4 s             | -0.5 | 3   | rad   | 1     |
    | 10  | last_action, first            | -1   | 1   | -     | 1     |
    | 11  | last_action, second           | -1   | 1   | -     | 1     |

    ## Rewards
    The sum of five terms times their weights; `info["reward_terms"]` and `info["reward_weights"]` hold both, and
    `exo_env/tasks/judgement/rewards.py` gives reasons and sources.

    | Term       | Value                                                    | Weight |
    |------------|----------------------------------------------------------|--------|
    | tracking   | exp(-(error / 5 deg)^2)                                  | 1      |
    | assistance | -(moment of the device beyond need) / need, at least -2  | 0.75   |
    | smoothness | -mean square change of the action / 4                    | 0.2    |
    | reaction   | -(elbow reaction / 500 N - 1) beyond 500 N, at least -2  | 0.2    |
    | unsafe     | -1 where an event ends the episode                       | 100    |

    ## Starting State
    At rest on the reference, muscles as the patient's command wants them; the agonist holds what they do not, but for
    "pid_setpoint". Each field of the patient, the load (0.5 to 2 kg), each
    number of the repetition and the noise of each channel comes from a random stream of its own, of the one number that
    a reset takes from the environment's generator. `reset(options={...})` fixes any of `patient`, `load` [kg],
    `reference` (numbers of a repetition: `start_deg` from 20 to 100, with `amplitude_deg` up to 100 in all) and
    `initial_angle_deg` (0 to 142); all else is drawn as without it. Where that is not the reference's, the setpoint of
    "pid_setpoint" begins at the arm and goes to the reference within 2 s. `info` of a reset holds what was drawn, and
    `ability`, the share of arm and load that the patient can hold (`exo_env/patient/ability.py`).

    ## Episode End
    Terminated, with a sentence in `info["event"]`, when the elbow leaves -5 to 147 deg, a rope exceeds 1000 N, the
    elbow reaction exceeds 2500 N, or the solver fails (then the observation is the last one, and
    `info["solver_failed"]` is true). The elbow has stops at 0 and 142 deg, which yield by less than 3 deg where an arm
    falls straight; at rest against a stop is no event, far beyond one is. Truncated after `episode_duration` (6 s), or
    as long for each of several repetitions, at whatever control rate; so the registration has no `max_episode_steps`,
    and the spec of an environment says its own.

    ## Arguments
    All by keyword, all JSON.

    | Argument           | Default          | Meaning                                                                  |
    |--------------------|------------------|--------------------------------------------------------------------------|
    | `patient`          | `"mixed"`        | population by name or YAML file; fields of one, or of a patient          |
    | `load`             | `None`           | weight [kg], or a distribution; `None`: 0.5 to 2                         |
    | `exoskeleton`      | `None`           | device by name or YAML file, or changes of the default one               |
    | `misalignment`     | `None`           | `shift` [x, y, z] m of the hinge, `tilt_deg` [about x, then y]           |
    | `cuff`             | `None`           | `"compliant"`, or `stiffness` and `damping` of it; `None`: a rigid guide |
    | `subject`          | `"arm26"`        | anatomy by name or YAML file                                             |
    | `reference`        | `None`           | distributions of start_deg, amplitude_deg, rest, duration, pause         |
    | `action_mode`      | `"rope_tension"` | or `"pid_setpoint"`, `"assist_moment"`, `"impedance"`                    |
    | `drive_settings`   | `None`           | changes of the mode's settings, see `exo_env/drives`                     |
    | `observation`      | `["device"]`     | groups, or single channels as `"group.channel"`, in order                |
    | `noise`            | `True`           | `False`, or a channel's deviation, delay and quantum                     |
    | `reward_weights`   | `None`           | changes of the weights                                                   |
    | `limits`           | `None`           | changes of lowest_deg, highest_deg, tension, reaction                    |
    | `control_rate`     | `50.0`           | [Hz]                                                                     |
    | `episode_duration` | `None`           | [s]; `None`: 6 s for each repetition                                     |
    | `cycle`            | `None`           | number of different episodes, after which the first comes again          |
    | `rtol`             | `None`           | of the solver; `None`: the angle within some 0.05 deg                    |
    | `render_mode`      | `None`           | `"human"` or `"rgb_array"`                                               |
    | `repetitions`      | `1`              | one begins every `episode_duration / repetitions`, or after the last one |

    `readings()` gives every sensor of the model without noise. `summary()` is a table of terms,
    channels and actions, as text. A copied or pickled environment is the same environment, amid the same episode. Axes
    of a misalignment are those of the links: x forward, y up along the humerus, z along the hinge.

    ## Version History
    * v2: the rest before a lift is drawn, so that the time does not tell when it begins; elbows have stops, and a
      straight arm rests; the patient acts at a rate of its own and predicts through its delays; further action modes
    * v1: every number of an episode has a random stream of its own, so that other patients are drawn; physics, rewards
      and observations are those of v0
    * v0: first version
    """

    task_type: ClassVar[type[Task]] = LiftTask
    settings_type: ClassVar[type[EnvSettings]] = ElbowLiftSettings
    settings: ElbowLiftSettings

    def usual_duration(self, settings: EnvSettings) -> float:
        """Length of an episode where the settings name none: six seconds a repetition [s]."""
        assert isinstance(settings, ElbowLiftSettings)
        check_whole("repetitions", settings.repetitions, MOST_REPETITIONS)
        return TIME * settings.repetitions

    def made_movement(self, reference: Any) -> Movement:
        """Repetitions, as many as the settings say."""
        check_whole("repetitions", self.settings.repetitions, MOST_REPETITIONS)
        return self._that_fits(Repetitions.of(reference).repeated(self.settings.repetitions), reference)


class ElbowLiftVectorEnv(AssistanceVectorEnv):
    """Many ElbowLiftEnv in one compiled batch; see AssistanceVectorEnv."""

    env_type: ClassVar[type[AssistanceEnv]] = ElbowLiftEnv

"""The environment exo/ElbowLift-v0."""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from dms_core import SolverOptions
from dms_core.compiled.arena import Packed
from dms_core.errors import InputError, choices
from dms_core.kernels import DONE, MATRIX_SINGULAR
from dms_core.results import Result
from dms_core.simulation.dynamics import RESULT_OF
from exo_env.drives.drive import checked_action, drive
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.envs.settings import SOLVER_OPTIONS, TIME, load_distribution, within, worn_device
from exo_env.patient.population import Source, population
from exo_env.rendering.scene import Scene
from exo_env.tasks.limits import NOTHING, Limits
from exo_env.tasks.movement import MOST_REPETITIONS, MOVEMENT, Repetitions
from exo_env.tasks.observer import Observer, Slice
from exo_env.tasks.rewards import Weights
from exo_env.world.control_period import STATUS, Plant, finish, run_period
from exo_env.world.episode import Episode
from exo_env.world.readout import Readout
from exo_env.world.world import Rig

OPTIONS = ("patient", "load", "reference", "initial_angle_deg")


class ElbowLiftEnv(gymnasium.Env):
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
    `Box(-1, 1, (2,), float32)`. Numbers beyond -1 to 1 are clipped; a number that is not finite, or another shape, is
    an error. An action says what the commands are at the end of its control period. With `action_mode="rope_tension"`
    (the default) these are tensions, which change by at most 2000 N/s and follow with a lag of 0.02 s:

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

    ## Observation Space
    `Box`, float32, of the groups in `observation`: "device" (the default) is what a worn exoskeleton can measure, "emg"
    noisy activations, "privileged" the patient's parameters and true muscle forces. An observation times its scale is
    the reading in its unit; `env.unwrapped.observation_structure` says the same of every group. Of "device":

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
    `exo_env/tasks/rewards.py` gives reasons and sources.

    | Term       | Value                                                    | Weight |
    |------------|----------------------------------------------------------|--------|
    | tracking   | exp(-(error / 5 deg)^2)                                  | 1      |
    | assistance | -(moment of the device beyond need) / need, at least -2  | 0.75   |
    | smoothness | -mean square change of the action / 4                    | 0.2    |
    | reaction   | -(elbow reaction / 500 N - 1) beyond 500 N, at least -2  | 0.2    |
    | unsafe     | -1 where an event ends the episode                       | 100    |

    ## Starting State
    At rest on the reference, muscles as the patient's command wants them; with "rope_tension" the agonist holds what
    they do not. Patient, load (0.5 to 2 kg) and repetition are drawn from the environment's one generator.
    `reset(options={...})` fixes any of `patient`, `load` [kg], `reference` (fields of a repetition) and
    `initial_angle_deg`; all else is drawn as without it. `info` of a reset holds what was drawn, and `ability`, the
    share of arm and load that the patient can hold (`exo_env/patient/ability.py`).

    ## Episode End
    Terminated, with a sentence in `info["event"]`, when the elbow leaves 0 to 142 deg, a rope exceeds 1000 N, the
    elbow reaction exceeds 2500 N, or the solver fails (then the observation is the last one, and
    `info["solver_failed"]` is true). Truncated after `episode_duration` (6 s), or as long for each of
    several repetitions, at whatever control rate; so the registration has no `max_episode_steps`.

    ## Arguments
    All by keyword, all JSON.

    | Argument           | Default          | Meaning                                                                  |
    |--------------------|------------------|--------------------------------------------------------------------------|
    | `patient`          | `"mixed"`        | population by name or YAML file; fields of one, or of a patient          |
    | `load`             | 0.5 to 2         | weight [kg], or a distribution                                           |
    | `exoskeleton`      | `None`           | device by name, or changes of the default one                            |
    | `reference`        | `None`           | distributions of start_deg, amplitude_deg, rest, duration, pause         |
    | `action_mode`      | `"rope_tension"` | or `"pid_setpoint"`                                                      |
    | `drive_settings`   | `None`           | changes of the mode's motor or filter, see `exo_env/drives/drive.py`     |
    | `observation`      | `["device"]`     | groups, in order                                                         |
    | `noise`            | `True`           | `False`, or a channel's deviation, delay and quantum                     |
    | `reward_weights`   | `None`           | changes of the weights                                                   |
    | `limits`           | `None`           | changes of lowest_deg, highest_deg, tension, reaction                    |
    | `control_rate`     | 50               | [Hz]                                                                     |
    | `episode_duration` | `None`           | [s]; `None`: 6 s for each repetition                                     |
    | `repetitions`      | 1                | one begins every `episode_duration / repetitions`, or after the last one |
    | `rtol`             | `None`           | of the solver; `None`: the angle within some 0.05 deg                    |
    | `render_mode`      | `None`           | `"human"` or `"rgb_array"`                                               |

    `readings()` gives every sensor of the model without noise. A pickled environment keeps settings and generator, and
    has to be reset.

    ## Version History
    * v0: first version
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 50}

    def __init__(
        self,
        *,
        patient: Source = "mixed",
        load: float | Mapping[str, Any] | None = None,
        exoskeleton: str | Mapping[str, Any] | None = None,
        reference: Mapping[str, Any] | None = None,
        action_mode: str = "rope_tension",
        drive_settings: Mapping[str, Any] | None = None,
        observation: Sequence[str] = ("device",),
        noise: bool | Mapping[str, Any] = True,
        reward_weights: Mapping[str, float] | None = None,
        limits: Mapping[str, float] | None = None,
        control_rate: float = 50.0,
        episode_duration: float | None = None,
        repetitions: int = 1,
        rtol: float | None = None,
        render_mode: str | None = None,
        **unknown: Any,
    ) -> None:
        if unknown:
            keyword = inspect.Parameter.KEYWORD_ONLY
            known = [n for n, p in inspect.signature(ElbowLiftEnv).parameters.items() if p.kind is keyword]
            raise InputError(f"setting '{next(iter(unknown))}' is unknown; there are {choices(known)}.")
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            modes = choices(self.metadata["render_modes"])
            raise InputError(f"render_mode = {render_mode!r}; one of {modes} is wanted, or None.")
        if render_mode is not None:
            from exo_env.rendering.canvas import import_pygame

            import_pygame()
        if type(repetitions) is not int or not 1 <= repetitions <= MOST_REPETITIONS:
            raise InputError(f"repetitions = {repetitions!r}; a whole number from 1 to {MOST_REPETITIONS} is wanted.")
        for name, value, low, high in (
            ("control_rate", control_rate, 5.0, 1000.0),
            ("episode_duration", episode_duration, 0.1, 120.0),
            ("rtol", rtol, 1e-8, 0.2),
        ):
            if not (name != "control_rate" and value is None) and not within(value, low, high):
                raise InputError(f"{name} = {value!r}; a number from {low:g} to {high:g} is wanted.")
        self.render_mode, self.metadata = render_mode, {**type(self).metadata, "render_fps": round(control_rate)}
        self.period, self.duration = 1.0 / control_rate, float(episode_duration or TIME * repetitions)
        self.population = population(patient)
        self.load = load_distribution(load)
        self._often, self.repetitions = repetitions, Repetitions.of(reference)
        self.ecosystem = Ecosystem(device=worn_device(exoskeleton))
        self.action_mode, self.drive = action_mode, drive(action_mode, dict(drive_settings or {}))
        self.weights, self.limits = Weights(**(reward_weights or {})), Limits(**(limits or {}))
        self.solver = SolverOptions(rtol=self.drive.rtol if rtol is None else rtol, **SOLVER_OPTIONS)
        self._weights = self.weights.model_dump()
        self.observer = Observer(observation, noise, self.period)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = spaces.Box(*self.observer.limits, dtype=np.float32)
        self._settings = {
            "patient": patient, "load": load, "exoskeleton": exoskeleton, "reference": reference,
            "action_mode": action_mode, "drive_settings": drive_settings, "observation": observation, "noise": noise,
            "reward_weights": reward_weights, "limits": limits, "control_rate": control_rate,
            "episode_duration": episode_duration, "repetitions": repetitions, "rtol": rtol, "render_mode": render_mode,
        }  # fmt: skip
        self._episode: Episode | None = None
        self._over = False
        self._renderer: Any = None

    @property
    def observation_structure(self) -> tuple[Slice, ...]:
        """Group, name, place, unit, scale and range of each part of the observation, in order."""
        return self.observer.structure

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """A new patient at the start of a repetition.

        Args:
            seed: of the environment's one generator.
            options: may fix 'patient' (whatever the constructor takes), 'load' [kg], 'reference' (fields of a
                repetition) and 'initial_angle_deg' [deg]. What is fixed is drawn all the same, so that nothing else
                changes.

        Raises:
            InputError: an option is unknown or not usable.
        """
        self.prepare(seed, options)
        self.opened(self.rig.open())
        if self.render_mode == "human":
            self.render()
        return self._plant.observation.astype(np.float32), self.start_info()

    def prepare(self, seed: int | None = None, options: Mapping[str, Any] | None = None) -> None:
        """First part of a reset: draw an episode. The second opens it in compiled code, the third is `opened`."""
        super().reset(seed=seed)
        self._over, self._episode = True, None
        if not isinstance(options, Mapping | None):
            raise InputError(f"options = {options!r}; a mapping with some of {choices(OPTIONS)} is wanted, or None.")
        for name in options or {}:
            if name not in OPTIONS:
                raise InputError(f"reset option '{name}' is unknown; there are {choices(OPTIONS)}.")
        self.rig.prepare(*self._drawn(options or {}), self.np_random)

    def opened(self, code: int) -> None:
        """Last part of a reset, with what came of the opening."""
        self._episode = self.rig.opened(code)
        self._readout = Readout(self._episode, self._plant)
        self._over = False

    def _drawn(self, options: Mapping[str, Any]) -> tuple[np.ndarray, float, np.ndarray, float]:
        """Patient, load [kg], movement and start [rad]; what is fixed is drawn all the same, and shifts nothing else.

        What is fixed to a distribution draws from a generator of its own.
        """
        patient = self.population.draw(self.np_random)
        load = float(self.load.quantile(self.np_random.random()))
        movement = self.repetitions.draw(self.np_random)
        seed = int(self.np_random.integers(2**63))
        start_deg = movement[MOVEMENT.start_deg]
        if options:
            fixed = np.random.default_rng(seed)
            if "patient" in options:
                patient = population(options["patient"]).draw(fixed)
            if "load" in options:
                load = float(load_distribution(options["load"]).quantile(fixed.random()))
            if "reference" in options:
                movement = Repetitions.of(options["reference"]).draw(fixed)
            start_deg = options.get("initial_angle_deg", movement[MOVEMENT.start_deg])
        low, high = self.limits.lowest_deg, self.limits.highest_deg
        if not within(start_deg, low, high):
            raise InputError(f"initial_angle_deg = {start_deg!r}; a number from {low:g} to {high:g} is wanted.")
        return patient, load, movement, math.radians(start_deg)

    @cached_property
    def rig(self) -> Rig:
        """The world, in which all episodes take place."""
        return Rig(
            self.ecosystem, self.action_mode, self.drive, period=self.period, duration=self.duration,
            repetitions=self._often, observer=self.observer, weights=self.weights, limits=self.limits,
            options=self.solver,
        )  # fmt: skip

    @property
    def packed(self) -> Packed:
        """The packed Plant, for a batch."""
        return self.rig.packed

    @property
    def _plant(self) -> Plant:
        return self.rig.plant

    @property
    def episode(self) -> Episode:
        """The present episode.

        Raises:
            gymnasium.error.ResetNeeded: `reset` was not called.
        """
        if self._episode is None:
            raise gymnasium.error.ResetNeeded("The environment has no episode; call reset() first.")
        return self._episode

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One control period, over which the commands go linearly to those of an action.

        Args:
            action: two numbers; beyond -1 to 1 they are clipped.

        Raises:
            InputError: the action has another shape or is not finite.
            gymnasium.error.ResetNeeded: there is no episode, or it is over.
        """
        used, _ = checked_action(action), self.episode
        if self._over:
            raise gymnasium.error.ResetNeeded("The episode is over; call reset() before the next step().")
        plant, status = self._plant, self._plant.status
        # Until the period is done to its end: what breaks it off leaves nothing to step.
        self._over = True
        if run_period(self.rig.packed.table, used) != DONE:
            self.rescue()
        terminated, truncated = bool(status[STATUS.event] != NOTHING), bool(status[STATUS.step] == status[STATUS.steps])
        self._over = terminated or truncated
        if self.render_mode == "human":
            self.render()
        info = self._readout.info(self._weights, self.happened())
        return plant.observation.astype(np.float32), float(plant.reward[0]), terminated, truncated, info

    def rescue(self) -> None:
        """Go on where compiled code gave up: a singular matrix may want another order of elimination."""
        episode, world, status = self.episode, self.episode.world, self._plant.status
        world.result = RESULT_OF[int(status[STATUS.code])]
        if status[STATUS.code] == MATRIX_SINGULAR:
            world.advance(float(episode.times[status[STATUS.step] + 1]))
        if world.result is Result.INTERRUPTED:
            raise KeyboardInterrupt
        if world.result is Result.SUCCESS:
            status[STATUS.code] = DONE
            self.rig.follow_world()
        finish(self.rig.packed.table)

    def happened(self) -> str | None:
        """The sentence on what ended the episode, or None."""
        return self._readout.happened(self.limits)

    def readings(self) -> dict[str, float]:
        """Everything of the paper's figures 9 to 13 at the present time, without noise: every sensor of the model.

        Beside them 'time' [s], 'reference' and 'tracking_error' [rad], 'elbow_reaction' [N], 'device_share' and
        'effort' [-], the commands reached, counts and worst errors of the solver. Units: `reading_units()`.
        """
        _ = self.episode
        return self._readout.readings()

    def reading_units(self) -> dict[str, str]:
        """Unit of each sensor in `readings`."""
        return dict(self.episode.model.layout.outputs)

    def start_info(self) -> dict[str, Any]:
        """What the episode is made of."""
        _ = self.episode
        return self._readout.start_info()

    def scene(self) -> Scene:
        """What a picture shows of the present time."""
        from exo_env.rendering.episode_scene import staged

        _ = self.episode
        return staged(self._readout, self._label())

    def _label(self) -> str:
        """Names the patient in a picture."""
        p = self.episode.patient
        return f"flexors {p.maximum_activation_flexors:.0%}, extensors {p.maximum_activation_extensors:.0%}"

    def render(self) -> np.ndarray | None:
        """The arm from the side: an array of shape (480, 480, 3) in mode 'rgb_array', a window in mode 'human'."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() was called without a render_mode; give one to gymnasium.make.")
            return None
        if self._renderer is None:
            from exo_env.rendering.renderer import Renderer

            mode: Any = self.render_mode
            self._renderer = Renderer(mode, fps=self.metadata["render_fps"])
        return self._renderer.draw(self.scene())

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def __getstate__(self) -> dict[str, Any]:
        """Settings and generator; the episode's compiled world stays behind, and a copy must be reset."""
        return {"settings": self._settings, "generator": self._np_random, "seed": self._np_random_seed}

    def __setstate__(self, state: dict[str, Any]) -> None:
        type(self).__init__(self, **state["settings"])
        self._np_random, self._np_random_seed = state["generator"], state["seed"]

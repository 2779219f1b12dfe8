"""What all environments share: one assisted arm as a Gymnasium environment.

An environment is a task (tasks/task.py), drives to choose from by `action_mode` (drives/drive.py), an ecosystem and
settings. One with a page and an id of its own is a subclass in a file of its own:

    class HoldStillEnv(AssistanceEnv):
        task_type = HoldStill
        drives = {"rope_tension": RopeTension}

    class HoldStillVectorEnv(AssistanceVectorEnv):         envs/vector_env.py
        env_type = HoldStillEnv

    register(id="mine/HoldStill-v0", entry_point=HoldStillEnv, vector_entry_point=HoldStillVectorEnv,
             disable_env_checker=True)
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces

from dms_core import SolverOptions
from dms_core.errors import InputError, SimulationError, choices
from dms_core.kernels import DONE, MATRIX_SINGULAR, Packed
from dms_core.results import Result
from dms_core.simulation.dynamics import RESULT_OF
from dms_core.validation import plain
from exo_env.drives.checked import check_drive
from exo_env.drives.drive import Drive, checked_action
from exo_env.drives.modes import DRIVES
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.subject import read_subject
from exo_env.envs.copies import Copied
from exo_env.envs.draw import EpisodeDraws, Keys
from exo_env.envs.settings import (
    SOLVER_OPTIONS,
    EnvSettings,
    checked_settings,
    load_distribution,
    owned,
    whole_periods,
    worn_cuff,
    worn_device,
    worn_misalignment,
)
from exo_env.patient.population import population
from exo_env.rendering.scene import Scene
from exo_env.tables import STATUS
from exo_env.tasks.movements.movement import Movement
from exo_env.tasks.observation.channels import Parts, Slice
from exo_env.tasks.observation.observer import Observer
from exo_env.tasks.task import NOTHING, Task
from exo_env.world.episodes.episode import Episode
from exo_env.world.episodes.held_episode import take_up
from exo_env.world.episodes.readout import Readout
from exo_env.world.kernels.control_period import finish, move, next_stop, run_period
from exo_env.world.world import PatientWorld


class AssistanceEnv(Copied, gymnasium.Env):
    """One arm with a worn device, as an environment. See the page of a subclass, such as `ElbowLiftEnv`.

    Args:
        settings: settings by keyword, see `EnvSettings` or the environment's page.

    Raises:
        InputError: a setting is unknown or not usable.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 50}
    task_type: ClassVar[type[Task]]
    drives: ClassVar[Mapping[str, type[Drive]]] = DRIVES
    settings_type: ClassVar[type[EnvSettings]] = EnvSettings
    ecosystem_type: ClassVar[type[Ecosystem]] = Ecosystem
    duration: float = 6.0
    """Length of an episode [s], unless the settings say otherwise."""

    def __init__(self, **settings: Any) -> None:
        # What a caller does to a mapping afterwards must not reach into the environment.
        self.settings = s = checked_settings(self.settings_type, owned(settings))
        if s.render_mode is not None:
            from exo_env.rendering.canvas import import_pygame

            import_pygame()
        self.render_mode, self.period = s.render_mode, 1.0 / s.control_rate
        self.metadata = {**type(self).metadata, "render_fps": round(s.control_rate)}
        wanted = float(s.episode_duration or self.usual_duration(s))
        self.steps, self.duration = whole_periods(wanted, s.control_rate)
        self.ecosystem = self.made_ecosystem(s)
        self.action_mode, self.drive = s.action_mode, self._made_drive(s)
        check_drive(self.drive, self.ecosystem.device)
        actions = self.drive.actions(self.ecosystem.device)
        self.task = self.made_task(s, Parts(self.ecosystem.arm().muscles, tuple(self.ecosystem.device.ropes), actions))
        self.movement, self.population = self.made_movement(s.reference), population(s.patient)
        self.load = load_distribution(s.load)
        self.observer = Observer(s.observation, self.task.readings, self.task.groups, s.noise, self.period)
        self.solver = SolverOptions(rtol=self.drive.rtol if s.rtol is None else s.rtol, **SOLVER_OPTIONS)
        self.actions = len(actions)
        self.action_space = spaces.Box(-1.0, 1.0, (self.actions,), np.float32)
        self.observation_space = spaces.Box(*self.observer.limits, dtype=np.float32)
        self._weights = self.task.weights.model_dump()
        self._draws = EpisodeDraws(
            self.population, self.load, self.movement, self.made_movement, self.duration,
            self.ecosystem.arm().within_stops(*self.task.start_range()), self.task.draws(),
        )  # fmt: skip
        self._sources = self._draws.sources
        self._keys = Keys(s.cycle)
        self._readout: Readout | None = None
        self._over = False
        self._renderer: Any = None

    def usual_duration(self, settings: EnvSettings) -> float:
        """Length of an episode where the settings name none [s]."""
        return type(self).duration

    def made_ecosystem(self, settings: EnvSettings) -> Ecosystem:
        """Arm, device and machine of the settings."""
        return self.ecosystem_type(
            device=worn_device(settings.exoskeleton), subject=read_subject(settings.subject),
            misalignment=worn_misalignment(settings.misalignment), cuff=worn_cuff(settings.cuff),
        )  # fmt: skip

    def made_task(self, settings: EnvSettings, parts: Parts) -> Task:
        """The task, with its weights and limits as the settings change them."""
        return self.task_type(parts, settings.reward_weights, settings.limits)

    def made_movement(self, reference: Any) -> Movement:
        """The movement that patients intend.

        Args:
            reference: changes of its distributions, None for none.

        Raises:
            InputError: one of them is unknown or not possible.
        """
        return self._that_fits(self.task_type.movement_type.of(reference), reference)

    def _that_fits(self, movement: Movement, given: Any) -> Movement:
        """The movement, with a warning where somebody gave one that the episode may cut off."""
        if given is not None and movement.longest() > self.duration + 1e-9:
            warnings.warn(
                f"the movement may take {movement.longest():.4g} s, and an episode ends after {self.duration:.4g} s: "
                "what is left is cut off; give a longer episode_duration, or a shorter reference.",
                stacklevel=4,
            )
        return movement

    def _made_drive(self, settings: EnvSettings) -> Drive:
        """The drive of the action mode, with some of its settings."""
        if settings.action_mode not in self.drives:
            raise InputError(f"action_mode = {settings.action_mode!r}: expected one of {choices(self.drives)}.")
        given = settings.drive_settings
        if not (given is None or isinstance(given, Mapping)):
            raise InputError(f"drive_settings = {given!r}: expected a mapping, or None.")
        return self.drives[settings.action_mode](**(given or {}))

    @property
    def observation_structure(self) -> tuple[Slice, ...]:
        """Group, name, place, unit, scale and range of each part of the observation, in order."""
        return self.observer.structure

    @property
    def weights(self) -> Any:
        """Weights of the reward terms."""
        return self.task.weights

    @property
    def limits(self) -> Any:
        """Limits that end an episode."""
        return self.task.limits

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode: a new patient at the start of a movement.

        Args:
            seed: seed of the environment's one generator.
            options: may fix 'patient' (whatever the constructor takes), 'load' [kg], 'reference' (numbers of the
                movement) and 'initial_angle_deg' [deg]; nothing else changes by that.

        Returns:
            Observation and `info`, see `start_info`.

        Raises:
            InputError: an option is unknown or not usable.
            SimulationError: the episode has no consistent start.
        """
        self.prepare(seed, options)
        self.begun(self.world.begin())
        if self.render_mode == "human":
            self.render()
        return self._observation(), self.start_info()

    def _observation(self) -> np.ndarray:
        return self.world.tables.observer.observation.astype(np.float32)

    def prepare(self, seed: int | None = None, options: Mapping[str, Any] | None = None) -> None:
        """First part of a reset: draw an episode. The second is compiled code, the third is `begun`.

        Args:
            seed: seed of the generator, None to go on.
            options: options of the reset.

        Raises:
            InputError: an option is unknown or not usable.
        """
        super().reset(seed=plain(seed))
        self._over, self._episode, self._held = True, None, None
        if seed is not None:
            self._keys.restart()
        sources = self._draws.changed(self._sources, options)
        self.world.prepare(self._draws.draw(self._keys.next(self.np_random), sources))

    def set_reset_options(self, options: Mapping[str, Any] | None) -> None:
        """Options of every reset from now on, for curricula; those that a reset is given come on top.

        Raises:
            InputError: an option is unknown or not usable.
        """
        self._sources = self._draws.changed(self._draws.sources, options)

    def begun(self, code: int) -> None:
        """Last part of a reset.

        Args:
            code: what came of the compiled part, see world/kernels/reset.py.

        Raises:
            InputError: the arm could bring the rope's end to a pulley.
            SimulationError: the episode has no consistent start.
        """
        self._episode = Episode(self.world, *self.world.begun(code))
        self._readout = Readout(self.world, self._episode)
        self.check_finite(self.world.tables.observer.observation, 0.0)
        self._over = False

    @cached_property
    def world(self) -> PatientWorld:
        """The world in which all episodes take place; that of a copy goes on with the episode that was copied."""
        world = PatientWorld(
            self.ecosystem, self.drive, self.task, self.movement, self.observer, period=self.period,
            duration=self.duration, steps=self.steps, options=self.solver,
        )  # fmt: skip
        if self._held is not None:
            self._episode, self._held = take_up(world, self._held), None
            self._readout = Readout(world, self._episode)
        return world

    @property
    def packed(self) -> Packed:
        """The packed `WorldTables` of the world, for a batch."""
        return self.world.packed

    @property
    def under_way(self) -> bool:
        """Whether there is an episode, be it over or not."""
        return self._episode is not None or self._held is not None

    @property
    def episode(self) -> Episode:
        """The present episode.

        Raises:
            gymnasium.error.ResetNeeded: `reset` was not called.
        """
        if self._held is not None:
            _ = self.world  # takes it up
        if self._episode is None:
            raise gymnasium.error.ResetNeeded("The environment has no episode; call reset() first.")
        return self._episode

    @property
    def readout(self) -> Readout:
        """True readings of the present episode."""
        _ = self.episode
        assert self._readout is not None
        return self._readout

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Do one control period, over which the commands go linearly to those of an action.

        Args:
            action: numbers, which are clipped to -1 to 1.

        Returns:
            Observation, reward, whether an event ended the episode, whether time did, and `info`.

        Raises:
            InputError: the action has another shape or is not finite.
            SimulationError: the task's own code gives a reward or an observation that is not finite.
            gymnasium.error.ResetNeeded: there is no episode, or it is over.
        """
        used, _ = checked_action(action, self.actions), self.episode
        status = self.world.tables.status.tolist()
        # A batch that moves the world keeps its own account of what is over.
        if self._over or status[STATUS.step] >= self.steps or status[STATUS.event] != NOTHING:
            raise gymnasium.error.ResetNeeded("The episode is over; call reset() before the next step().")
        # Until the period is done to its end: what breaks it off leaves nothing to step.
        self._over = True
        world = self.world
        if run_period(world.packed.table, used) != DONE:
            self.rescue()
        observation, reward = self._observation(), world.tables.task.reward.item()
        self.check_finite(observation, reward)
        status = world.tables.status.tolist()
        terminated, truncated = status[STATUS.event] != NOTHING, status[STATUS.step] == self.steps
        self._over = terminated or truncated
        if self.render_mode == "human":
            self.render()
        info = self.readout.info(self._weights, self.happened() if terminated else None)
        return observation, reward, terminated, truncated, info

    def check_finite(self, observation: np.ndarray, reward: float) -> None:
        """Refuse what a task's own code may give.

        Raises:
            SimulationError: observation or reward is not finite; names reward terms, readings and channels.
        """
        # Nearly always a sum of squares tells it in one cheap call.
        if math.isfinite(reward + float(observation.dot(observation))):
            return
        if not (math.isfinite(reward) and np.isfinite(observation).all()):
            raise SimulationError(self.readout.not_finite())

    def rescue(self) -> None:
        """Go on where compiled code gave up: a singular matrix may need another order of elimination."""
        dynamics, status = self.world.dynamics, self.world.tables.status
        dynamics.result = RESULT_OF[int(status[STATUS.code])]
        while status[STATUS.code] == MATRIX_SINGULAR:
            dynamics.advance(next_stop(self.world.packed.table))
            if dynamics.result is Result.INTERRUPTED:
                raise KeyboardInterrupt
            if dynamics.result is not Result.SUCCESS:
                break
            self.world.follow_dynamics()
            dynamics.result = RESULT_OF[move(self.world.packed.table)]
        finish(self.world.packed.table)

    def happened(self) -> str | None:
        """The sentence on what ended the episode, or None."""
        return self.readout.happened()

    def readings(self) -> dict[str, float]:
        """Everything at the present time, without noise, by name.

        These are all components of the model's sensors, the readings of the task, the commands reached, 'time' [s], and
        counts and worst errors of the solver. `reading_units()` gives the units.
        """
        return self.readout.readings()

    def reading_units(self) -> dict[str, str]:
        """Unit of each sensor and reading in `readings`."""
        units = {reading.name: reading.unit for reading in self.readout.known_readings() if not reading.sensors}
        return dict(self.episode.model.layout.outputs) | units

    def start_info(self) -> dict[str, Any]:
        """The `info` of a reset: patient, load, ability, movement and angle of the start."""
        return self.readout.start_info(self.movement)

    def summary(self) -> str:
        """A table of what is active: reward terms with their weights, observed channels, actions, and what ends."""
        return self.task.summary(self.observation_structure)

    def scene(self) -> Scene:
        """Points and numbers of a picture of the present time."""
        from exo_env.rendering.episode_scene import scene_of

        return scene_of(self.readout, self._label())

    def _label(self) -> str:
        """Words that name the patient in a picture."""
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

"""Many environments of one kind in a compiled batch: gymnasium.make_vec("exo_env:exo/ElbowLift-v2", num_envs=N)."""

from __future__ import annotations

import copy
import threading
import warnings
from collections.abc import Callable, Sequence
from functools import wraps
from operator import attrgetter
from typing import Any, ClassVar, Self

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from dms_core.errors import InputError, SimulationError, choices
from dms_core.validation import plain, shown
from exo_env.drives.drive import as_numbers
from exo_env.envs.base_env import AssistanceEnv
from exo_env.envs.copies import WithSpec
from exo_env.envs.settings import check_whole
from exo_env.tables import STATUS
from exo_env.tasks.task import NOTHING, SOLVER, Task
from exo_env.world.batch import ELSEWHERE, Batch
from exo_env.world.episodes.episode import Episode
from exo_env.world.kernels.reset import BEGUN

EPISODE = attrgetter("_episode")
"""Gives the episode of an environment, None where there is none: cheaper than the property, which raises."""


MOST_STEPS, MOST_WORLDS, MOST_THREADS = 10**9, 10**6, 10**4
"""Largest `max_episode_steps`, numbers of worlds and of threads."""


def one_at_a_time(method: Callable) -> Callable:
    """A method that refuses to begin while another thread is in one: two would move the same worlds at once."""

    @wraps(method)
    def alone(self: AssistanceVectorEnv, *given: Any, **named: Any) -> Any:
        # To wait would hang in a process that was forked while a thread of its parent was in here.
        if not self._turn.acquire(blocking=False):
            raise gymnasium.error.AlreadyPendingCallError(
                f"{method.__name__}() was called while another thread steps or resets this vector environment; expected"
                " calls one after the other, or a vector environment for each thread.",
                method.__name__,
            )
        try:
            return method(self, *given, **named)
        finally:
            self._turn.release()

    return alone


class AssistanceVectorEnv(WithSpec, VectorEnv):
    """Many environments that compiled code steps in parallel, each the same to the last bit as alone.

    A subclass names the environment as `env_type`.

    Args:
        num_envs: number of worlds.
        autoreset_mode: a gymnasium.vector.AutoresetMode: a new episode begins at the step after the last one's end
            (default), at the same step, or at a call of `reset` only, which is the way for torchrl.
        threads: number of threads that step the worlds; None takes one for each core.
        max_episode_steps: control periods after which time ends an episode, as `gymnasium.make_vec` gives them; None
            and -1: those of the environment's `episode_duration`.
        settings: settings of the environment.

    Raises:
        InputError: a setting is not usable.
    """

    env_type: ClassVar[type[AssistanceEnv]]

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        max_episode_steps: int | None = None,
        **settings: Any,
    ) -> None:
        num_envs, threads, max_episode_steps = plain(num_envs), plain(threads), plain(max_episode_steps)
        check_whole("num_envs", num_envs, MOST_WORLDS)
        if threads is not None:
            check_whole("threads", threads, MOST_THREADS)
        modes = [mode.value for mode in AutoresetMode]
        if autoreset_mode not in [*AutoresetMode, *modes]:
            raise InputError(f"autoreset_mode = {autoreset_mode!r}: expected one of {choices(modes)}.")
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.num_envs, self._turn = num_envs, threading.Lock()
        one = self.env_type(**settings)
        with warnings.catch_warnings():
            # What the first one has said.
            warnings.simplefilter("ignore")
            self.envs = [one, *(self.env_type(**settings) for _ in range(num_envs - 1))]
        self.steps = one.steps
        """Control periods of an episode that no event ends."""
        if max_episode_steps not in (None, -1):
            check_whole("max_episode_steps", max_episode_steps, MOST_STEPS)
            self.steps = min(self.steps, max_episode_steps)
        self.render_mode = one.render_mode
        self.metadata = {**one.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_observation_space, self.single_action_space = one.observation_space, one.action_space
        self.observation_space = batch_space(one.observation_space, self.num_envs)
        self.action_space = batch_space(one.action_space, self.num_envs)
        self._task: Task = one.task
        self._batch = self._made_batch(threads)
        self._over = np.ones(num_envs, bool)
        self._episodes: list[Episode | None] = [None] * num_envs
        self._started = False

    def _made_batch(self, threads: int | None) -> Batch:
        places = np.array([place for _, place, _ in self._task.reported_places], np.int64)
        return Batch(self.num_envs, self.envs[0].observer.size, len(self._task.terms), places, threads)

    @property
    def observation_structure(self) -> tuple:
        """Parts of one environment's observation, see `AssistanceEnv.observation_structure`."""
        return self.envs[0].observation_structure

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Reset all worlds, or those of options['reset_mask'].

        Args:
            seed: seed of the first world, of which each further one has one more; or a list of one a world.
            options: options of the environment's reset, and 'reset_mask', booleans of shape (num_envs,).

        Raises:
            InputError: seeds or mask do not fit, or an option is not usable.
        """
        if not isinstance(options, dict | None):
            raise InputError(f"options = {options!r}: expected one mapping for all worlds, or None.")
        options = dict(options or {})
        mask = self._mask(options.pop("reset_mask", None))
        return self.reset_each(self._seeds(seed), [options] * self.num_envs, mask)

    @one_at_a_time
    def reset_each(
        self, seeds: Sequence[int | None], options: Sequence[dict[str, Any]], mask: np.ndarray | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Reset worlds with a seed and options for each, see `reset`.

        Args:
            seeds: seed of each world, None to go on, shape (num_envs,).
            options: options of each world, shape (num_envs,).
            mask: which worlds are reset, shape (num_envs,); None: all.

        Raises:
            InputError: an option is not usable.
        """
        where = np.ones(self.num_envs, bool) if mask is None else mask
        # A reset that fails half-way leaves nothing to step.
        self._over[where], self._started = True, False
        infos = self._begin(where, {}, seeds, options)
        self._started = True
        return self._batch.observations.copy(), infos

    def set_reset_options(self, options: dict[str, Any] | None) -> None:
        """Options of every reset from now on, automatic ones included; see AssistanceEnv.set_reset_options."""
        for env in self.envs:
            env.set_reset_options(options)

    def _mask(self, mask: Any) -> np.ndarray:
        """Which worlds are reset, shape (num_envs,)."""
        if mask is None:
            return np.ones(self.num_envs, bool)
        if not (isinstance(mask, np.ndarray) and mask.shape == (self.num_envs,) and mask.dtype == bool and mask.any()):
            raise InputError(f"reset_mask = {mask!r}: expected {self.num_envs} booleans, one of them true.")
        if not self._started and not mask.all():
            raise gymnasium.error.ResetNeeded("The first reset() has to reset all worlds.")
        return mask

    def _seeds(self, seed: Any) -> list[int | None]:
        """The seed of each world."""
        seed = plain(seed)
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int):
            return [seed + i for i in range(self.num_envs)]
        if not isinstance(seed, Sequence) or isinstance(seed, str):
            raise InputError(f"seed = {seed!r}: expected a whole number, or one for each of {self.num_envs} worlds.")
        if len(seed) != self.num_envs:
            raise InputError(f"{len(seed)} seeds for {self.num_envs} worlds: expected one seed, or one a world.")
        return list(seed)

    def _begin(
        self,
        where: np.ndarray,
        infos: dict[str, Any],
        seeds: Sequence[int | None] | None = None,
        options: Sequence[dict[str, Any]] | None = None,
    ) -> dict[str, Any]:
        """New episodes in the worlds `where`, shape (num_envs,), begun on all threads; gives the infos with theirs."""
        which = np.flatnonzero(where)
        for i in which.tolist():
            env = self.envs[i]
            env.prepare(seeds[i] if seeds else None, options[i] if options else None)
            self._batch.put(i, env.packed)
        for i, code in zip(which.tolist(), self._batch.begin(which).tolist(), strict=True):
            self.envs[i].begun(code)
            if code != BEGUN:
                self._take_over(i)
            self._episodes[i], self._over[i] = self.envs[i].episode, False
            infos = self._add_info(infos, self.envs[i].start_info(), i)
        return infos

    def _take_over(self, i: int) -> None:
        """Take world i over from its environment, which has ordered its equations anew."""
        self._batch.put(i, self.envs[i].packed)
        self._batch.take(i)

    @one_at_a_time
    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Do a control period of every world.

        Args:
            actions: shape (num_envs, n); beyond -1 to 1 they are clipped.

        Raises:
            InputError: the actions have another shape or are not finite.
            SimulationError: the task's own code gives a reward or an observation that is not finite.
            gymnasium.error.ResetNeeded: an episode is over and nothing resets it by itself.
        """
        used = self._checked(actions)
        if not self._started or (self.autoreset_mode == AutoresetMode.DISABLED and self._over.any()):
            raise gymnasium.error.ResetNeeded("An episode is over, or none has begun; call reset() first.")
        if list(map(EPISODE, self.envs)) != self._episodes:
            i = [a is b for a, b in zip(map(EPISODE, self.envs), self._episodes, strict=True)].index(False)
            raise gymnasium.error.ResetNeeded(f"World {i} was reset by itself; call reset() of the batch.")
        running = ~self._over
        which = np.flatnonzero(running)
        # Until the step is done to its end: what breaks it off leaves nothing to step.
        self._started = False
        for i in self._batch.run(which, used):
            if self._batch.status[i, STATUS.code] == ELSEWHERE:
                raise gymnasium.error.ResetNeeded(f"World {i} was stepped by itself; call reset() of the batch.")
            self.envs[i].rescue()
            self._take_over(i)
        status = self._batch.status
        rewards = np.where(running, self._batch.numbers[:, 0], 0.0)
        self._check_finite(rewards)
        terminated = running & (status[:, STATUS.event] != NOTHING)
        truncated = running & (status[:, STATUS.step] == self.steps)
        infos = self._infos(running) if running.any() else {}
        self._over = ~running | terminated | truncated
        infos = self._begin(~running, infos)
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._over.any():
            infos = self._same_step(self._over.copy(), infos)
        self._started = True
        return self._batch.observations.copy(), rewards, terminated, truncated, infos

    def _check_finite(self, rewards: np.ndarray) -> None:
        """Refuse rewards and observations that are not finite; names the world."""
        fine = np.isfinite(rewards) & np.isfinite(self._batch.observations).all(axis=1)
        if not fine.all():
            i = int(np.flatnonzero(~fine)[0])
            raise SimulationError(f"World {i}: {self.envs[i].readout.not_finite()}")

    def _checked(self, actions: Any) -> np.ndarray:
        """The actions, clipped to the box; refuses those that are not finite or of another shape."""
        try:
            used = as_numbers(actions)  # any other order would be compiled for anew
        except (TypeError, ValueError, OverflowError, RuntimeError):
            raise InputError(
                f"actions = {shown(actions)}: expected numbers, shape {self.action_space.shape}."
            ) from None
        if used.shape != self.action_space.shape:
            raise InputError(f"actions have shape {used.shape}: expected {self.action_space.shape}.")
        if not np.isfinite(used).all():
            i = int(np.flatnonzero(~np.isfinite(used).all(axis=1))[0])
            raise InputError(f"actions[{i}] = {used[i].tolist()}: expected finite numbers.")
        return np.clip(used, -1.0, 1.0)

    def _same_step(self, ended: np.ndarray, stepped: dict[str, Any]) -> dict[str, Any]:
        """Begin the episodes of worlds that ended one now; what they ended with is in final_obs and final_info."""
        last, infos = self._batch.observations.copy(), self._infos(~ended) if not ended.all() else {}
        plain = ("time", *(number.name for number in self._task.reported), "solver_failed")
        for i in np.flatnonzero(ended).tolist():
            final = {name: stepped[name][i].item() for name in plain}
            final |= {group: {name: stepped[group][name][i].item() for name in self._task.terms} for group in GROUPED}
            if "event" in stepped and stepped["_event"][i]:
                final["event"] = stepped["event"][i]
            infos = self._add_info(infos, {"final_obs": last[i], "final_info": final}, i)
        return self._begin(ended, infos)

    def _infos(self, running: np.ndarray) -> dict[str, Any]:
        """Infos of a step as Gymnasium's own vector environments give them: arrays, and masks of where they hold."""
        numbers, status, task = self._batch.numbers, self._batch.status, self._task
        terms, reported = numbers[:, 1 : 1 + len(task.terms)].T, numbers[:, 1 + len(task.terms) :].T

        def where(column: np.ndarray) -> np.ndarray:
            return np.where(running, column, 0.0)

        values = {name: where(column) for name, column in zip(task.terms, terms, strict=True)}
        weights = {name: where(np.full(self.num_envs, w)) for name, w in task.weights.model_dump().items()}
        masks = {f"_{name}": running.copy() for name in task.terms}
        infos: dict[str, Any] = {
            "reward_terms": values | masks,
            "reward_weights": weights | {name: mask.copy() for name, mask in masks.items()},
            "time": where(status[:, STATUS.step] * self.envs[0].period),
            **{
                number.name: where(number.factor * column)
                for number, column in zip(task.reported, reported, strict=True)
            },
            "solver_failed": running & (status[:, STATUS.event] == SOLVER),
        }
        infos |= {f"_{name}": running.copy() for name in list(infos)}
        for i in np.flatnonzero(running & (status[:, STATUS.event] != NOTHING)).tolist():
            infos = self._add_info(infos, {"event": self.envs[i].happened()}, i)
        return infos

    def render(self) -> tuple[Any, ...] | None:
        """A picture of each world."""
        return None if self.render_mode is None else tuple(env.render() for env in self.envs)

    def __copy__(self) -> Self:
        """A copy with worlds and generators of its own."""
        return copy.deepcopy(self)

    @one_at_a_time
    def __getstate__(self) -> dict[str, Any]:
        """All attributes but those of one process, which a copy makes anew; the episodes go along with their worlds."""
        kept = {name: value for name, value in self.__dict__.items() if name not in ("_batch", "_episodes", "_turn")}
        return kept | {"_threads": self._batch.threads}

    def __setstate__(self, state: dict[str, Any]) -> None:
        threads = state.pop("_threads")
        self.__dict__.update(state, _turn=threading.Lock(), _episodes=[None] * state["num_envs"])
        self._batch = self._made_batch(threads)
        for i, env in enumerate(self.envs):
            if env.under_way:
                self._episodes[i] = env.episode
                self._take_over(i)

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Generator of each world."""
        return self.get_attr("np_random")

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """Seed of each world's generator."""
        return self.get_attr("np_random_seed")

    def call(self, name: str, *given: Any, **named: Any) -> tuple[Any, ...]:
        """What a method gives for each world, or an attribute of each."""
        found = [getattr(env, name) for env in self.envs]
        return tuple(x(*given, **named) if callable(x) else x for x in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of each world."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of each world: a list or tuple has one value a world, anything else is for all.

        Raises:
            InputError: it is a setting, from which the environment was made, or there are too few or too many values.
        """
        each = list(values) if isinstance(values, list | tuple) else [values] * self.num_envs
        if len(each) != self.num_envs:
            raise InputError(
                f"set_attr('{name}'): {len(each)} values for {self.num_envs} worlds; expected one a world."
            )
        self.refuse_made(name)
        for env, value in zip(self.envs, each, strict=True):
            setattr(env, name, value)

    def refuse_made(self, name: str) -> None:
        """Refuse to set what environments were made with, or what follows from it.

        Raises:
            InputError: says what to do instead.
        """
        if name in (*self.env_type.settings_type.model_fields, *MADE):
            raise InputError(
                f"'{name}' cannot be set from outside: the environments were made with it. Give it when they are made, "
                "or, for patient, load, reference and initial_angle_deg, to set_reset_options."
            )

    def close_extras(self, **kwargs: Any) -> None:
        """End threads and windows."""
        self._batch.close()
        for env in self.envs:
            env.close()


MADE = ("drive", "task", "ecosystem", "population", "movement", "observer", "period", "duration", "steps", "solver")
"""Attributes of an environment that follow from its settings."""
GROUPED = ("reward_terms", "reward_weights")
"""Keys of a step's infos that hold one number for each world and reward term."""

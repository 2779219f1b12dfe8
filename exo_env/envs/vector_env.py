"""The vector environment: gymnasium.make_vec("exo_env:exo/ElbowLift-v0", num_envs=N)."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from dms_core.errors import InputError, choices
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.tasks.limits import NOTHING, SOLVER
from exo_env.tasks.rewards import TERMS
from exo_env.world.batch import NUMBERS, Batch
from exo_env.world.control_period import STATUS
from exo_env.world.episode import Episode
from exo_env.world.reset import OPEN

EPISODE = attrgetter("_episode")
"""Of an environment, None where there is none: cheaper than the property, which raises."""
AT = {name: k for k, name in enumerate(NUMBERS)}


class ElbowLiftVectorEnv(VectorEnv):
    """Many ElbowLiftEnv that compiled code steps in parallel, each the same to the last bit as alone.

    Args:
        num_envs: number of worlds.
        autoreset_mode: of gymnasium.vector.AutoresetMode: at the step after an episode's end (default), at the same
            step, or never.
        threads: that step the worlds; None takes one for each core.
        settings: of ElbowLiftEnv.

    Raises:
        InputError: a setting is not usable.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        **settings: Any,
    ) -> None:
        if not (isinstance(num_envs, int | np.integer) and num_envs >= 1):
            raise InputError(f"num_envs = {num_envs!r}; a whole number from 1 is wanted.")
        if threads is not None and not (isinstance(threads, int) and threads >= 1):
            raise InputError(f"threads = {threads!r}; a whole number from 1 is wanted, or None.")
        modes = [mode.value for mode in AutoresetMode]
        if autoreset_mode not in [*AutoresetMode, *modes]:
            raise InputError(f"autoreset_mode = {autoreset_mode!r}; one of {choices(modes)} is wanted.")
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.num_envs = int(num_envs)
        self.envs = [ElbowLiftEnv(**settings) for _ in range(self.num_envs)]
        one = self.envs[0]
        self.render_mode = one.render_mode
        self.metadata = {**one.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_observation_space, self.single_action_space = one.observation_space, one.action_space
        self.observation_space = batch_space(one.observation_space, self.num_envs)
        self.action_space = batch_space(one.action_space, self.num_envs)
        self._batch = Batch(self.num_envs, one.observer.size, threads)
        self._over = np.ones(self.num_envs, bool)
        self._episodes: list[Episode | None] = [None] * self.num_envs
        self._started = False

    @property
    def observation_structure(self) -> tuple:
        """As ElbowLiftEnv.observation_structure."""
        return self.envs[0].observation_structure

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Reset all worlds, or those of options['reset_mask'].

        Args:
            seed: of the first world, one more for each further one; or one a world.
            options: of ElbowLiftEnv.reset, and 'reset_mask', booleans of shape (num_envs,).

        Raises:
            InputError: seeds or mask do not fit, or an option is not usable.
        """
        if not isinstance(options, dict | None):
            raise InputError(f"options = {options!r}; one mapping for all worlds is wanted, or None.")
        options = dict(options or {})
        mask = self._mask(options.pop("reset_mask", None))
        seeds = self._seeds(seed)
        # A reset that fails half-way leaves nothing to step.
        self._over[mask], self._started = True, False
        infos = self._begin(mask, {}, seeds, options)
        self._started = True
        return self._batch.observations.copy(), infos

    def _mask(self, mask: Any) -> np.ndarray:
        """Worlds to reset."""
        if mask is None:
            return np.ones(self.num_envs, bool)
        if not (isinstance(mask, np.ndarray) and mask.shape == (self.num_envs,) and mask.dtype == bool and mask.any()):
            raise InputError(f"reset_mask = {mask!r}; {self.num_envs} booleans, one of them true, are wanted.")
        if not self._started and not mask.all():
            raise gymnasium.error.ResetNeeded("The first reset() has to reset all worlds.")
        return mask

    def _seeds(self, seed: Any) -> list[int | None]:
        """One a world."""
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise InputError(f"{len(seed)} seeds for {self.num_envs} worlds; one seed, or one a world, is wanted.")
        return list(seed)

    def _begin(
        self,
        where: np.ndarray,
        infos: dict[str, Any],
        seeds: Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> dict[str, Any]:
        """New episodes in the worlds `where`, shape (num_envs,), opened on all threads; gives the infos with theirs."""
        which = np.flatnonzero(where)
        for i in which.tolist():
            env = self.envs[i]
            env.prepare(seeds[i] if seeds else None, options)
            self._batch.put(i, env.packed, env.rig.setting)
        for i, code in zip(which.tolist(), self._batch.open(which).tolist(), strict=True):
            self.envs[i].opened(code)
            if code != OPEN:
                self._take_over(i)
            self._episodes[i], self._over[i] = self.envs[i].episode, False
            infos = self._add_info(infos, self.envs[i].start_info(), i)
        return infos

    def _take_over(self, i: int) -> None:
        """World i from its environment, which has ordered its equations anew."""
        self._batch.put(i, self.envs[i].packed, self.envs[i].rig.setting)
        self._batch.take(i)

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """A control period of every world.

        Args:
            actions: shape (num_envs, 2); beyond -1 to 1 they are clipped.

        Raises:
            InputError: the actions have another shape or are not finite.
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
            self.envs[i].rescue()
            self._take_over(i)
        status = self._batch.status
        rewards = np.where(running, self._batch.numbers[:, 0], 0.0)
        terminated = running & (status[:, STATUS.event] != NOTHING)
        truncated = running & (status[:, STATUS.step] == status[:, STATUS.steps])
        infos = self._infos(running) if running.any() else {}
        self._over = ~running | terminated | truncated
        infos = self._begin(~running, infos)
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._over.any():
            infos = self._same_step(self._over.copy(), infos)
        self._started = True
        return self._batch.observations.copy(), rewards, terminated, truncated, infos

    def _checked(self, actions: Any) -> np.ndarray:
        """Finite actions within the box."""
        used = np.asarray(actions, float)
        if used.shape != (self.num_envs, 2):
            raise InputError(f"actions have shape {used.shape}; ({self.num_envs}, 2) is wanted.")
        if not np.isfinite(used).all():
            i = int(np.flatnonzero(~np.isfinite(used).all(axis=1))[0])
            raise InputError(f"actions[{i}] = {used[i].tolist()}; finite numbers are wanted.")
        return np.clip(used, -1.0, 1.0)

    def _same_step(self, ended: np.ndarray, told: dict[str, Any]) -> dict[str, Any]:
        """Begin the episodes of worlds that ended one now; what they ended with is in final_obs and final_info."""
        last, infos = self._batch.observations.copy(), self._infos(~ended) if not ended.all() else {}
        for i in np.flatnonzero(ended).tolist():
            final = {name: told[name][i].item() for name in _PLAIN}
            final |= {group: {name: told[group][name][i].item() for name in TERMS} for group in _GROUPED}
            if "event" in told and told["_event"][i]:
                final["event"] = told["event"][i]
            infos = self._add_info(infos, {"final_obs": last[i], "final_info": final}, i)
        return self._begin(ended, infos)

    def _infos(self, running: np.ndarray) -> dict[str, Any]:
        """Of a step, as gymnasium's own vector environments give it: arrays, and masks of where they hold."""
        numbers, status, env = self._batch.numbers, self._batch.status, self.envs[0]

        def column(name: str) -> np.ndarray:
            return np.where(running, numbers[:, AT[name]], 0.0)

        failed = running & (status[:, STATUS.event] == SOLVER)
        weights = {name: np.where(running, w, 0.0) for name, w in env.weights.model_dump().items()}
        infos: dict[str, Any] = {
            "reward_terms": {name: column(name) for name in TERMS} | {f"_{name}": running.copy() for name in TERMS},
            "reward_weights": weights | {f"_{name}": running.copy() for name in TERMS},
            "time": column("time") * env.period,
            "tracking_error_deg": np.degrees(column("tracking_error")),
            "device_share": column("device_share"),
            "effort": column("effort"),
            "elbow_reaction": column("elbow_reaction"),
            "solver_failed": failed,
        }
        infos |= {f"_{name}": running.copy() for name in list(infos)}
        for i in np.flatnonzero(running & (status[:, STATUS.event] != NOTHING)).tolist():
            infos = self._add_info(infos, {"event": self.envs[i].happened()}, i)
        return infos

    def render(self) -> tuple[Any, ...] | None:
        """A picture of each world."""
        return None if self.render_mode is None else tuple(env.render() for env in self.envs)

    def __getstate__(self) -> dict[str, Any]:
        """Refused: the worlds are addresses of this process."""
        raise TypeError("ElbowLiftVectorEnv cannot be copied or pickled; make another one of the same settings.")

    def close_extras(self, **kwargs: Any) -> None:
        """End threads and windows."""
        self._batch.close()
        for env in self.envs:
            env.close()


_PLAIN = ("time", "tracking_error_deg", "device_share", "effort", "elbow_reaction", "solver_failed")
"""Infos of a step that are one number a world."""
_GROUPED = ("reward_terms", "reward_weights")
"""Infos of a step that are one number a world and term."""

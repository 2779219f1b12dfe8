"""Many environments in a compiled batch as a VecEnv of Stable-Baselines3, which this module needs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv

from dms_core.errors import InputError
from exo_env.envs.vector_env import AssistanceVectorEnv


class AssistanceVecEnv(VecEnv):
    """N worlds that reset by themselves; infos of an ended episode have what Stable-Baselines3 looks for.

    `terminal_observation` is the last observation, and `TimeLimit.truncated` tells an episode that time ended from one
    that an event did, so that value estimates bootstrap where they should. An ended episode's time, the numbers that
    the task reports, and solver_failed are in it too. Infos of other periods are empty; `reset_infos` has what each
    world's present episode began with.

    Args:
        worlds: a batch, made with `autoreset_mode="SameStep"`.

    Raises:
        InputError: the batch resets its worlds otherwise.
    """

    def __init__(self, worlds: AssistanceVectorEnv) -> None:
        if worlds.autoreset_mode is not AutoresetMode.SAME_STEP:
            raise InputError(f"autoreset_mode = '{worlds.autoreset_mode.value}': expected 'SameStep'.")
        self.worlds, self.render_mode, self.metadata = worlds, worlds.render_mode, worlds.metadata
        super().__init__(worlds.num_envs, worlds.single_observation_space, worlds.single_action_space)
        self._actions: np.ndarray | None = None

    def reset(self) -> np.ndarray:
        """First observations, shape (num_envs, n), with the seeds of `seed` and the options of `set_options`.

        Both hold for this reset, as everywhere in Stable-Baselines3; `env_method("set_reset_options", {...})` gives
        options of the automatic resets behind an episode's end.
        """
        observations, _ = self.worlds.reset_each(self._seeds, self._options)
        self.reset_infos = [env.start_info() for env in self.worlds.envs]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Do a control period of every world; see `VecEnv`."""
        assert self._actions is not None
        observations, rewards, terminated, truncated, stepped = self.worlds.step(self._actions)
        over = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(over):
            final = {name: x for name, x in stepped["final_info"].items() if not name.startswith("_")}
            infos[i] = {name: x[i] for name, x in final.items() if isinstance(x, np.ndarray) and name != "event"} | {
                "terminal_observation": stepped["final_obs"][i],
                "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
            }
            self.reset_infos[i] = self.worlds.envs[i].start_info()
        return observations, rewards.astype(np.float32), over, infos

    def close(self) -> None:
        """End the threads."""
        self.worlds.close()

    def get_images(self) -> Sequence[np.ndarray | None]:
        """A picture of each world."""
        return self.worlds.render() or []

    def get_attr(self, attr_name: str, indices: None | int | Iterable[int] = None) -> list[Any]:
        """An attribute of some worlds."""
        return [getattr(self.worlds.envs[i], attr_name) for i in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: None | int | Iterable[int] = None) -> None:
        """Set an attribute of some worlds.

        Raises:
            InputError: it is a setting, from which the environment was made; says what to do instead.
        """
        self.worlds.refuse_made(attr_name)
        for i in self._get_indices(indices):
            setattr(self.worlds.envs[i], attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: None | int | Iterable[int] = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of some worlds."""
        return [
            getattr(self.worlds.envs[i], method_name)(*method_args, **method_kwargs) for i in self._get_indices(indices)
        ]

    def env_is_wrapped(self, wrapper_class: type, indices: None | int | Iterable[int] = None) -> list[bool]:
        """False for each world: worlds have no wrappers."""
        return [False for _ in self._get_indices(indices)]

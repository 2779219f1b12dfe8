"""A policy that is imitated: it acts in many worlds at once, in which it may see more than its student."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np

from dms_core.errors import InputError

from ...environment import make
from ...policies.learned import find_policy


class Teacher:
    """A policy in worlds that show what it sees beside what its student sees.

    Args:
        name: of the policy, as `find_policy` takes it.
        environment: id of the environment.
        settings: of the environment, with what the student sees as its observation.

    Raises:
        InputError: there is no such policy, or it acts in another environment, action mode or observation.
    """

    def __init__(self, name: str, environment: str, settings: Mapping[str, Any]) -> None:
        try:
            self._policy: Any = find_policy(name)
            self._env = make(environment, **{**settings, "observation": list(self._policy.observation)})
            world: Any = self._env.unwrapped
            if world.action_mode != self._policy.action_mode:
                raise InputError(
                    f"policy '{name}' acts by {self._policy.action_mode}: expected action_mode {world.action_mode}, as "
                    "in env_kwargs."
                )
            self.begin(1)
        except InputError as error:
            raise InputError(f"training.imitation.teacher: {error}") from None
        student: Any = make(environment, **settings).unwrapped
        own, theirs = _names(student), _names(world)
        self.observation = [*map(str, student.settings.observation), *(name for name in theirs if name not in own)]
        """What worlds have to show: what the student sees, then what only the teacher does."""
        both = make(environment, **{**settings, "observation": self.observation}).unwrapped
        places = _places(both)
        self.student_places = np.concatenate([places[name] for name in own])
        """Places of what the student sees in an observation of these worlds."""
        self._places = np.concatenate([places[name] for name in theirs])

    def begin(self, n: int) -> None:
        """Begin episodes in n worlds."""
        if hasattr(self._policy, "begin"):
            self._policy.begin(self._env, n)
            return
        # One that acts in a world at a time is there once a world.
        self._alone = [copy.deepcopy(self._policy) for _ in range(n)]
        for one in self._alone:
            one.reset(self._env)

    def act(self, observations: np.ndarray) -> np.ndarray:
        """What the teacher would do, shape (n, actions), after one more observation of the worlds, shape (n, k)."""
        seen = observations[:, self._places]
        if hasattr(self._policy, "act"):
            actions = self._policy.act(seen)
        else:
            actions = np.stack([one(row, {}) for one, row in zip(self._alone, seen, strict=True)])
        return np.clip(actions, -1.0, 1.0).astype(np.float32)


def _names(world: Any) -> list[str]:
    """Channels that a world shows, as "group.channel", in their order."""
    return [f"{part.group}.{part.name}" for part in world.observation_structure]


def _places(world: Any) -> dict[str, np.ndarray]:
    """Places of each channel in an observation."""
    return {f"{part.group}.{part.name}": np.arange(part.start, part.stop) for part in world.observation_structure}

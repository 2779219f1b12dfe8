"""Copies and specs of an environment: the same environment, whatever its owner, its files and its folder do meanwhile.

What a copy or a pickle holds is contents: no file is read again. An episode that is under way goes on in the copy, to
the same bits; the copy makes a world for it when it is first asked for something, which takes some 15 ms.
"""

from __future__ import annotations

import copy
import os
from functools import cached_property
from typing import Any, Self

from gymnasium.envs.registration import EnvSpec

from exo_env.world.episodes.episode import Episode
from exo_env.world.episodes.held_episode import HeldEpisode, hold
from exo_env.world.world import PatientWorld

TRANSIENT = ("_episode", "_readout", "_renderer", "world")
"""Attributes that a copy makes anew: they belong to one process."""


class WithSpec:
    """What Gymnasium says of how an environment was made, with files by their whole paths.

    Its `max_episode_steps`, which wrappers and libraries look up, is the number of control periods after which time
    ends an episode. Who makes another environment of the spec with a longer episode gives `max_episode_steps=-1`.
    """

    steps: int
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """How `gymnasium.make` made the environment; None where it did not."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None:
            spec = copy.deepcopy(spec)
            spec.kwargs = {name: _whole(value) for name, value in spec.kwargs.items()}
            spec.max_episode_steps = self.steps
        self._spec = spec


def _whole(value: Any) -> Any:
    """The whole path of a YAML file that a setting names; any other value as it is."""
    is_file = isinstance(value, str) and value.endswith((".yaml", ".yml")) and os.path.isfile(value)
    return os.path.abspath(value) if is_file else value


class Copied(WithSpec):
    """An environment whose copies and pickles are the same environment, with generators of their own."""

    _episode: Episode | None = None
    _held: HeldEpisode | None = None
    """Episode of the environment that was copied, until the copy takes it up."""

    @cached_property
    def world(self) -> PatientWorld:
        """The world in which the episode takes place."""
        raise NotImplementedError

    def __copy__(self) -> Self:
        """A copy with a generator of its own: sharing one would let each copy change what the other draws."""
        return copy.deepcopy(self)

    def __getstate__(self) -> dict[str, Any]:
        """All attributes, those in slots included, and the episode."""
        state: Any = super().__getstate__()
        attributes, slots = state if isinstance(state, tuple) else (state, {})
        kept = {name: value for name, value in {**attributes, **slots}.items() if name not in TRANSIENT}
        if self._episode is not None:
            kept["_held"] = hold(self.world, self._episode)
        return kept

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in {"_readout": None, "_renderer": None, **state}.items():
            setattr(self, name, value)

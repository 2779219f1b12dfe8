"""Moments of an episode, to which its world can be put back: a function may be called at any of them, and again."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dms_core.simulation.snapshot import Mark
from exo_env.clearing import Cleared, Filled, arrays_of
from exo_env.world.episodes.episode import Episode
from exo_env.world.world import PatientWorld


class Moment(NamedTuple):
    """A control time of an episode, with all that the future depends on."""

    episode: Episode
    mark: Mark
    """State of the equations."""
    arrays: tuple[bytes, ...]
    """Numbers of the model, and arrays of the tables that a reset fills or clears."""


class Moments:
    """The moments of one episode.

    Args:
        world: the world in which it takes place.
        episode: the episode.
    """

    def __init__(self, world: PatientWorld, episode: Episode) -> None:
        self.world, self.episode = world, episode
        self._arrays = [*world.model.numbers, *(x for _, x in arrays_of(world.tables, Filled, Cleared))]

    def now(self, before: Moment | None = None) -> Moment:
        """The present moment; what has not changed since the one before is held once."""
        arrays = tuple(x.tobytes() for x in self._arrays)
        if before is not None:
            arrays = tuple(old if old == new else new for old, new in zip(before.arrays, arrays, strict=True))
        return Moment(self.episode, self.world.dynamics.mark(), arrays)

    def go_to(self, there: Moment) -> None:
        """Put the world back to a moment of this episode, be it the present one."""
        dynamics, followed = self.world.dynamics, self.world.tables.dynamics
        dynamics.rewind(there.mark)
        if dynamics.tables is not followed.model or dynamics.packed is not followed.state:
            self.world.follow_dynamics()
        for into, content in zip(self._arrays, there.arrays, strict=True):
            into[...] = np.frombuffer(content, into.dtype).reshape(into.shape)

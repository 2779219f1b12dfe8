"""An episode that is put by, to go on in another world of the same environment, in this process or another.

It holds contents, no addresses: what a reset fills and clears (clearing.py), the numbers of the model, and the
snapshot of its state (dms_core). What goes on from it gives the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from dms_core.errors import InputError
from dms_core.simulation.snapshot import Snapshot
from exo_env.clearing import Cleared, Filled, arrays_of
from exo_env.patient.ability import Need
from exo_env.world.draw import Draw
from exo_env.world.episodes.episode import Episode
from exo_env.world.world import PatientWorld


@dataclass(frozen=True)
class HeldEpisode:
    """An episode as it was at a control time; it may be taken up any number of times."""

    draw: Draw
    need: Need
    past: Snapshot
    """State of the equations; without orders of elimination where they are the model's own."""
    numbers: tuple[bytes, ...]
    """Numbers of the model."""
    arrays: tuple[bytes, ...]
    """Arrays of the tables that a reset fills or clears."""


def _episode_arrays(world: PatientWorld) -> list[np.ndarray]:
    return [array for _, array in arrays_of(world.tables, Filled, Cleared)]


def hold(world: PatientWorld, episode: Episode) -> HeldEpisode:
    """The episode that takes place in a world, as it is now."""
    past = world.dynamics.snapshot()
    if world.dynamics.tables is world.model.tables:
        past = replace(past, orders=cast(Any, None))
    numbers, arrays = ([x.tobytes() for x in found] for found in (world.model.numbers, _episode_arrays(world)))
    return HeldEpisode(episode.draw, episode.need, past, tuple(numbers), tuple(arrays))


def take_up(world: PatientWorld, held: HeldEpisode) -> Episode:
    """Go on with an episode in a new world of the same environment.

    Raises:
        InputError: it was held by another version of this package, whose worlds have other arrays.
    """
    _put_back(world.model.numbers, held.numbers)
    own = world.dynamics.snapshot().orders
    world.dynamics.restore(replace(held.past, orders=held.past.orders or own))
    world.follow_dynamics()
    _put_back(_episode_arrays(world), held.arrays)
    return Episode(world, held.draw, held.need)


def _put_back(arrays: Sequence[np.ndarray], contents: Sequence[bytes]) -> None:
    if [x.nbytes for x in arrays] != [len(content) for content in contents]:
        raise InputError(
            "The episode of this copy was begun by another version of exo_env, and cannot go on here; expected a "
            "reset() first."
        )
    for into, content in zip(arrays, contents, strict=True):
        into[...] = np.frombuffer(content, into.dtype).reshape(into.shape)

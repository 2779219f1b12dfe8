"""What a reset draws at random: patient, load, movement and start of the next episode, all from one key.

The key is the one number that a reset takes from the environment's generator; everything else comes from random streams
of the key by name (streams.py), so that what `options` fix moves nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dms_core.errors import InputError, choices
from exo_env.envs.settings import load_distribution, owned, within
from exo_env.patient.distributions import Distribution, Draws
from exo_env.patient.population import Population, population
from exo_env.streams import stream, uniform
from exo_env.tasks.movements.movement import START, Movement
from exo_env.world.draw import Draw

OPTIONS = ("patient", "load", "reference", "initial_angle_deg")
"""Options of a reset."""
LOAD, PHASE = "load", stream("tremor.phase")
"""Random streams of the load and of the tremor's phase."""


class Keys:
    """Keys of the episodes, one after the other.

    Args:
        cycle: number of different keys, after which the first comes again; None: every key is new.
    """

    def __init__(self, cycle: int | None) -> None:
        self.cycle = cycle
        self._known: list[int] = []
        self._taken = 0

    def restart(self) -> None:
        """Forget all keys, as a new seed of the generator asks for."""
        self._known, self._taken = [], 0

    def next(self, generator: np.random.Generator) -> int:
        """Key of the next episode."""
        self._taken += 1
        if self.cycle is not None and self._taken > self.cycle:
            return self._known[(self._taken - 1) % self.cycle]
        key = int(generator.integers(2**63))
        if self.cycle is not None:
            self._known.append(key)
        return key


def checked_options(options: Any) -> Mapping[str, Any]:
    """Options of a reset; none for None.

    Raises:
        InputError: they are no mapping, or one of them is unknown.
    """
    if not isinstance(options, Mapping | None):
        raise InputError(f"options = {options!r}: expected a mapping with some of {choices(OPTIONS)}, or None.")
    for name in options or {}:
        if name not in OPTIONS:
            raise InputError(f"reset option '{name}' is unknown; there are {choices(OPTIONS)}.")
    return options or {}


@dataclass(frozen=True)
class Sources:
    """What an episode is drawn from."""

    patients: Population
    loads: Draws
    """Distribution of the weight on the machine [kg]."""
    movement: Movement
    """What patients intend."""
    start_deg: float | None = None
    """Angle at which the episode begins [deg]; None: where the movement starts."""


class EpisodeDraws:
    """What the episodes of an environment are drawn from.

    Args:
        patients: population.
        load: distribution of the weight on the machine [kg].
        movement: what patients intend.
        movement_of: makes another movement from what a reset option gives.
        duration: length of an episode [s].
        start_range: elbow angles at which an episode may begin [deg].
        of_task: distributions of the numbers that the task draws, by name.

    Raises:
        InputError: the movement may start where no episode may.
    """

    def __init__(
        self,
        patients: Population,
        load: Distribution,
        movement: Movement,
        movement_of: Callable[[Any], Movement],
        duration: float,
        start_range: tuple[float, float],
        of_task: Mapping[str, Distribution],
    ) -> None:
        self._of_task = Draws({f"task.{name}": spread for name, spread in of_task.items()})
        self.movement_of, self.duration, self.start_range = movement_of, duration, start_range
        self.sources = self._checked(Sources(patients, Draws({LOAD: load}), movement))

    def changed(self, sources: Sources, options: Any) -> Sources:
        """Sources with the options of a reset in place of what they fix.

        Args:
            sources: what is drawn from where an option is not given.
            options: options of a reset, None for none.

        Raises:
            InputError: an option is unknown or not usable.
        """
        made: dict[str, Any] = {}
        for name, given in checked_options(options).items():
            value = owned(given)
            if name == "patient":
                made["patients"] = population(value)
            elif name == "load":
                made["loads"] = Draws({LOAD: load_distribution(value)})
            elif name == "reference":
                made["movement"] = self.movement_of(value)
            else:
                made["start_deg"] = self._start(value)
        return self._checked(replace(sources, **made)) if made else sources

    def _start(self, angle: Any) -> float:
        """An angle at which an episode may begin [deg]."""
        low, high = self.start_range
        if not within(angle, low, high):
            raise InputError(f"initial_angle_deg = {angle!r}: expected a number from {low:g} to {high:g}.")
        return float(angle)

    def _checked(self, sources: Sources) -> Sources:
        """The sources, if every start that they give is one at which an episode may begin."""
        low, high = self.start_range
        starts = sources.movement.spread(START).limits()
        if sources.start_deg is None and not all(within(x, low, high) for x in starts):
            raise InputError(
                f"The movement may start from {min(starts):g} to {max(starts):g} deg, but limits and the elbow's stops "
                f"let an episode begin from {low:g} to {high:g} deg; give wider limits, or a reference with other "
                f"{START}."
            )
        return sources

    def draw(self, key: int, sources: Sources) -> Draw:
        """What is drawn for the episode of a key.

        Args:
            key: key of the random streams.
            sources: what is drawn from; another source of one thing moves nothing else.
        """
        k = np.uint64(key)
        numbers = sources.movement.draw(k, self.duration)
        start_deg = sources.start_deg
        if start_deg is None:
            start_deg = float(numbers[sources.movement.names.index(START)])
        phase = 2.0 * math.pi * uniform(k, PHASE, 0)
        patient, load = sources.patients.draw(k), float(sources.loads.sample(k)[0])
        return Draw(key, patient, load, numbers, self._of_task.sample(k), math.radians(start_deg), phase)

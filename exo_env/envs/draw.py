"""What a reset draws at random: patient, load, movement and start of the next episode, all from one key.

The key is the one number that a reset takes from the environment's generator; everything else comes from random streams
of the key by name (streams.py), so that what `options` fix moves nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from dms_core.errors import InputError, choices
from exo_env.envs.settings import load_distribution, within
from exo_env.patient.distributions import Distribution, Draws
from exo_env.patient.population import Population, population
from exo_env.streams import stream, uniform
from exo_env.tasks.movement import START, Movement
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


class EpisodeDraws:
    """What the episodes of an environment are drawn from.

    Args:
        patients: population.
        load: distribution of the weight on the machine [kg].
        movement: what patients intend.
        movement_of: makes another movement from what a reset option gives.
        duration: length of an episode [s].
        start_range: elbow angles at which an episode may begin [deg].
    """

    def __init__(
        self,
        patients: Population,
        load: Distribution,
        movement: Movement,
        movement_of: Callable[[Any], Movement],
        duration: float,
        start_range: tuple[float, float],
    ) -> None:
        self.patients, self.loads, self.movement = patients, Draws({LOAD: load}), movement
        self.movement_of, self.duration, self.start_range = movement_of, duration, start_range

    def draw(self, key: int, options: Mapping[str, Any]) -> Draw:
        """What is drawn for the episode of a key.

        Args:
            key: key of the random streams.
            options: options of the reset; what they fix is drawn from the same streams, and moves nothing else.

        Raises:
            InputError: an option is not usable.
        """
        k = np.uint64(key)
        patients = population(options["patient"]) if "patient" in options else self.patients
        loads = Draws({LOAD: load_distribution(options["load"])}) if "load" in options else self.loads
        movement = self.movement_of(options["reference"]) if "reference" in options else self.movement
        numbers = movement.draw(k, self.duration)
        start_deg = options.get("initial_angle_deg", numbers[movement.names.index(START)])
        low, high = self.start_range
        if not within(start_deg, low, high):
            raise InputError(f"initial_angle_deg = {start_deg!r}: expected a number from {low:g} to {high:g}.")
        phase = 2.0 * math.pi * uniform(k, PHASE, 0)
        return Draw(key, patients.draw(k), float(loads.sample(k)[0]), numbers, math.radians(start_deg), phase)

"""Declared numbers of an episode's world, by name: their values, and what they move."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dms_core import Model
from dms_core.assembly.derivatives.parameter_derivatives import Direction
from dms_core.sensitivity.moved import MovedNumbers
from dms_core.sensitivity.nodes import Number
from exo_env.ecosystem.ecosystem import REFERENCE
from exo_env.world.episodes.episode import Episode
from exo_env.world.kernels.scaling import TEMPLATE_ANGLE, declared

MOVED_PARTS = 3
"""Arrays of `Model.numbers` that declared numbers move: of dynamics, constraints and sensors."""


class Moved(NamedTuple):
    """The numbers of a model where declared numbers have other values."""

    change: tuple[np.ndarray, ...]
    """What is added to each of the first MOVED_PARTS of `Model.numbers`."""
    model: Model
    """A model that declares the moved numbers."""
    directions: list[Direction]
    """What each declared number moves from there."""


class DeclaredNumbers:
    """Declared numbers of the world of one episode.

    Args:
        episode: the episode.
        numbers: which ones.

    Raises:
        InputError: there is no such number, or one places a joint, so that the start of the episode would not fit it.
    """

    def __init__(self, episode: Episode, numbers: Sequence[Number]) -> None:
        self.episode, self.numbers = episode, tuple(numbers)
        self._at_load: dict[float, MovedNumbers] = {}
        self._last: tuple[Model | None, Moved | None] = (None, None)
        self.declared = self._with(episode.load).declared if self.numbers else np.zeros(0)
        """Declared values with the weight of the start, shape (n,)."""

    def _with(self, load: float) -> MovedNumbers:
        """The numbers in a model that declares this patient with a weight on the machine [kg]."""
        if load not in self._at_load:
            episode, world = self.episode, self.episode.model
            psi = next(x.signal for x in world.system.inputs if x.name == REFERENCE)
            ecosystem = episode.ecosystem.changed(weight=load)
            system = declared(
                ecosystem, episode.drive, TEMPLATE_ANGLE, episode.drive.start(ecosystem.device, 0.0), reference=psi,
                activations=np.full(len(episode.arm.muscles), 0.1), times=episode.patient.time_constants(episode.arm),
            )  # fmt: skip
            self._at_load[load] = MovedNumbers(Model(system, like=world), self.numbers)
        return self._at_load[load]

    def at(self, values: np.ndarray, load: float) -> Moved:
        """The numbers of the world at other values of the declared ones, shape (n,), with a weight on the machine [kg].

        Raises:
            InputError: a value is not finite, or there are more or fewer of them.
        """
        own = self._with(load)
        model = own.at(values)
        if self._last[0] is not model or self._last[1] is None:
            # Sizes and welds, which follow, are those of the declaration.
            change = tuple(
                new - old for new, old in zip(model.numbers[:MOVED_PARTS], own.model.numbers[:MOVED_PARTS], strict=True)
            )
            directions = [model.parameter_derivatives.direction(*x) for x in self.numbers]
            self._last = model, Moved(change, model, directions)
        assert self._last[1] is not None
        return self._last[1]

"""What a patient intends to do: the contract of a movement, and the simplest one, staying at rest.

A movement is psi(t), the elbow angle that the patient wants, as polynomials in pieces. It is a settings class whose
fields are distributions of its numbers, and a compiled kernel that makes pieces of the numbers that were drawn:

    kernel(w)      reads floats(plan, PLAN.movement), writes floats(plan, PLAN.starts) and
                   matrix(plan, PLAN.coefficients), with plan = inner(w, WORLD.plan); it may change
                   floats(plan, PLAN.loads), the weight at each control time [kg], which is the drawn one so far

Piece i holds from starts[i] [s] on, as sum_j coefficients[i, j] (t - starts[i])^j [rad]; the first holds before its
start too, and the last for ever. The patient plans the motor command for psi, and errors are from psi; whether the
device knows psi is the task's choice of channels.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.errors import InputError
from dms_core.kernels import floats, inner, matrix
from exo_env.patient.distributions import Distribution, Draws, distribution
from exo_env.places import places
from exo_env.settings import Settings, given_mapping
from exo_env.tables import PLAN, WORLD
from exo_env.tasks.checked import check_movement

START = "start_deg"
"""Name of the number that every movement has first: the elbow angle at the start [deg]."""


class Movement(Settings):
    """Base of all movements: a distribution for each number, in the order of the fields, `start_deg` first."""

    kernel: ClassVar[Any]

    @classmethod
    def of(cls, source: Mapping[str, Any] | None) -> Self:
        """The movement with some of its distributions given.

        Raises:
            InputError: it is no mapping, or a distribution is not possible; or the movement itself is wrongly declared.
        """
        movement = cls(**given_mapping("reference", source, f"some of {', '.join(cls.model_fields)}, or None"))
        check_movement(movement)
        return movement

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers that are drawn."""
        return tuple(type(self).model_fields)

    @property
    def pieces(self) -> int:
        """Number of pieces of psi, at least 3."""
        raise NotImplementedError

    def longest(self) -> float:
        """Time after which psi is at rest at the latest [s]."""
        return 0.0

    def episode_numbers(self, duration: float) -> tuple[float, ...]:
        """Further numbers that the episode fixes, behind those that are drawn; `duration` is the episode's [s]."""
        return ()

    def size(self, duration: float) -> int:
        """Number of all numbers, those that the episode fixes included; `duration` is the episode's [s]."""
        return len(self.names) + len(self.episode_numbers(duration))

    def spread(self, name: str) -> Distribution:
        """Distribution of a number.

        Raises:
            InputError: what was given is none.
        """
        try:
            return distribution(getattr(self, name))
        except InputError as error:
            raise InputError(f"reference: {name}: {error}") from None

    def draw(self, key: np.uint64, duration: float) -> np.ndarray:
        """Numbers of the movement in the episode of a key (streams.py); `duration` is the episode's [s]."""
        return np.array([*self._draws.sample(key), *self.episode_numbers(duration)])

    def values(self, numbers: np.ndarray) -> dict[str, float]:
        """The numbers that were drawn, by name."""
        return dict(zip(self.names, numbers.tolist(), strict=False))

    @cached_property
    def _draws(self) -> Draws:
        return Draws({f"movement.{name}": self.spread(name) for name in self.names})


REST = places((START,))


@compiled
def _stay(w):
    """Fill pieces of psi that stay at the start."""
    plan = inner(w, WORLD.plan)
    t, c = floats(plan, PLAN.starts), matrix(plan, PLAN.coefficients)
    c[:] = 0.0
    for k in range(t.shape[0]):
        t[k] = float(k)
        c[k, 0] = math.radians(floats(plan, PLAN.movement)[REST.start_deg])


class Stay(Movement):
    """The patient wants to stay where the episode begins."""

    kernel: ClassVar[Any] = _stay
    start_deg: Any = {"uniform": [20.0, 100.0]}

    @property
    def pieces(self) -> int:
        """Three pieces, the fewest that there may be."""
        return 3

"""The contract of a task: what is observed, rewarded and ended, and along which movement.

A task is a class in one file. It declares its reward terms (the fields of `weights_type`), what ends an episode
(`limits_type`, `events`), the movement that the patient intends, its readings and the groups of channels that show
them, and two compiled kernels, functions of a packed world w (exo_env/tables.py), which the batch calls by address:

    read(w)      fills the derived readings of the present control time, behind those that sensors give
    judge(w)     fills the value of each term, and sets the event that ends the episode, if there is one

When they are called, readings that name sensors are copied already, and so are traits of the patient. Where the solver
failed, `read` is not called, and `event_of(w)` is SOLVER in `judge`. Kernels take readings by name:

    R = places(["angle", "rate"])                      built once, from the names in the order of `readings`
    r, at = readings(w), first_of(w)                   the array, and where each reading begins in it
    r[at[R.angle]]                                     first component of a reading

Where places belong to readings that other tasks take over, as those of elbow.py, `begins(R, declared)` of checked.py
has a task refused that uses R and does not begin with these readings. All that a task declares is checked when it is
made.

The reward is the sum of the terms times their weights. An environment is a task, an ecosystem, drives and settings
(envs/base_env.py); the same task serves single environments and batches.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.errors import choices
from dms_core.kernels import floats, inner, ints
from exo_env.patient.distributions import Distribution
from exo_env.settings import Settings, given_mapping
from exo_env.tables import STATUS, TASK, WORLD
from exo_env.tasks.checked import check_task
from exo_env.tasks.movements.movement import Movement
from exo_env.tasks.observation.channels import Channel, Parts, Reading, Slice, first_places

NOTHING, SOLVER, FIRST_EVENT = range(3)
"""Codes of what ended an episode: nothing, a solver that failed, and the first event of the task's own."""
Values = Callable[[str], np.ndarray]
"""A function from the name of a reading to its components."""


@dataclass(frozen=True)
class Reported:
    """A number of `info` of a step, which is a reading in a unit that people like to read."""

    name: str
    """Key in `info`."""
    reading: str
    """Name of the reading, which has one component."""
    factor: float = 1.0
    """The number over the reading, such as 180 / pi from radians to degrees."""


class Task(ABC):
    """Base of all tasks.

    Args:
        parts: names of what the ecosystem and the drive have.
        weights: changes of the terms' weights.
        limits: changes of the limits.

    Raises:
        InputError: weights or limits are not possible, or what the task declares is wrong (checked.py).
    """

    weights_type: ClassVar[type[Settings]]
    """Settings with a weight for each reward term, in the order in which `judge` fills them."""
    limits_type: ClassVar[type[Settings]]
    """Settings with a method `numbers()`: what the kernels read of them."""
    movement_type: ClassVar[type[Movement]]
    events: ClassVar[tuple[str, ...]]
    """Names of what ends an episode; their codes begin with FIRST_EVENT."""
    preview: ClassVar[tuple[float, ...]] = ()
    """How far ahead the patient's plan is tabulated for the kernels [s]."""
    reported: ClassVar[tuple[Reported, ...]] = ()
    """Readings that `info` of a step has, beside the reward terms."""
    revealing: ClassVar[tuple[str, ...]] = ()
    """Groups of observations that show what the patient wants, where a policy is not to know it."""
    read: ClassVar[Any]
    judge: ClassVar[Any]

    def __init__(
        self, parts: Parts, weights: Mapping[str, float] | None = None, limits: Mapping[str, float] | None = None
    ) -> None:
        self.parts = parts
        self.weights = _made(self.weights_type, "reward_weights", weights)
        self.limits = _made(self.limits_type, "limits", limits)
        self.terms = tuple(type(self.weights).model_fields)
        """Names of the reward terms."""
        self.readings = self.declared_readings(parts)
        self.groups = self.declared_groups(parts)
        check_task(self)
        ends = first_places(self.readings).tolist()
        self.places = {r.name: slice(*ends[k : k + 2]) for k, r in enumerate(self.readings)}
        """Where the components of each reading stand in the array of all."""
        self.reported_places = tuple((x.name, self.places[x.reading].start, x.factor) for x in self.reported)
        """Name of each reported number, place of its reading, and factor."""

    @abstractmethod
    def declared_readings(self, parts: Parts) -> list[Reading]:
        """Everything that the kernels read and that channels show, in the order of the array."""

    @abstractmethod
    def declared_groups(self, parts: Parts) -> dict[str, list[Channel]]:
        """Channels of each group of observations, by the group's name."""

    @abstractmethod
    def sentence(self, event: str, values: Values) -> str:
        """A sentence for people on an event.

        Args:
            event: one of `events`.
            values: the readings at the time of the event.
        """

    def start_range(self) -> tuple[float, float]:
        """Elbow angles at which an episode may begin [deg], as far as the stops of the arm let it."""
        return -180.0, 180.0

    def draws(self) -> Mapping[str, Distribution]:
        """Distributions of numbers that the task itself draws for an episode, by name.

        Kernels read them, in this order, as `floats(inner(w, WORLD.draw), DRAW.task)`.
        """
        return {}

    def numbers(self) -> np.ndarray:
        """Numbers that the kernels read beside the readings: here those of the limits, shape (n,)."""
        return self.limits.numbers()

    def weight_numbers(self) -> np.ndarray:
        """Weight of each reward term, in their order, shape (n,)."""
        return np.array([getattr(self.weights, name) for name in self.terms], dtype=float)

    def summary(self, structure: Sequence[Slice]) -> str:
        """A table of what is active: reward terms, observed channels, actions, and what ends an episode.

        Args:
            structure: parts of the observation, see `AssistanceEnv.observation_structure`.
        """
        lines = [f"{type(self).__name__}", "", f"{'reward term':44}{'weight':>9}"]
        lines += [f"{name:44}{getattr(self.weights, name):9.4g}" for name in self.terms]
        lines += ["", f"{'observed channel':44} {'place':>8} {'unit':>9} {'scale':>7}"]
        for part in structure:
            place = str(part.start) if part.stop == part.start + 1 else f"{part.start}-{part.stop - 1}"
            lines.append(f"{part.group + '.' + part.name:44} {place:>8} {part.unit:>9} {part.scale:7.4g}")
        lines += ["", "actions: " + ", ".join(self.parts.actions), "ends with: " + ", ".join((*self.events, "solver"))]
        return "\n".join(lines)

    def event(self, code: int, values: Values) -> str:
        """The sentence on an event, by the event's code."""
        known = dict(enumerate(self.events, FIRST_EVENT))
        if code in known:
            return self.sentence(known[code], values)
        return f"The kernel judge of {type(self).__name__} gave the event number {code}; {self._expected_events()}."

    def solver_blamed(self) -> str:
        """The sentence where the task gives the code of a solver that failed, and none has."""
        return (
            f"The kernel judge of {type(self).__name__} gave the event number {SOLVER}, SOLVER, which is set where the "
            f"solver fails; it has not, and {self._expected_events()}."
        )

    def _expected_events(self) -> str:
        """What `end_with` takes, for a message."""
        known = ", ".join(f"{code} ({name})" for code, name in enumerate(self.events, FIRST_EVENT))
        return f"end_with expects one of {known}" if known else f"{type(self).__name__} declares no events"


def _made(kind: type[Settings], key: str, given: Any) -> Any:
    """Settings of a kind with some values given under a key."""
    return kind(**given_mapping(key, given, f"some of {choices(kind.model_fields)}, or None"))


@compiled
def readings(w):
    """All readings of a world, one component behind the other."""
    return floats(inner(w, WORLD.task), TASK.readings)


@compiled
def first_of(w):
    """Place of the first component of each reading, in the order of the task's readings."""
    return ints(inner(w, WORLD.task), TASK.first)


@compiled
def terms_of(w):
    """Value of each reward term, in the order of the weights."""
    return floats(inner(w, WORLD.task), TASK.terms)


@compiled
def task_numbers(w):
    """The numbers of `Task.numbers`."""
    return floats(inner(w, WORLD.task), TASK.numbers)


@compiled
def step_of(w):
    """Number of control periods that are done."""
    return ints(w, WORLD.status)[STATUS.step]


@compiled
def event_of(w):
    """Code of the event that ends the episode, NOTHING where there is none."""
    return ints(w, WORLD.status)[STATUS.event]


@compiled
def end_with(w, code):
    """End the episode with an event, unless another one has.

    Args:
        w: the packed world.
        code: FIRST_EVENT and the event's place in `Task.events`; any other number ends the episode too, with a
            sentence that says so.
    """
    status = ints(w, WORLD.status)
    if status[STATUS.event] == NOTHING:
        status[STATUS.event] = code

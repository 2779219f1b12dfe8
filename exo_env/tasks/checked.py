"""The check of what a task and a movement declare: every mistake is an InputError that names the task and the culprit.

Kernels find readings by their places, with nothing between them and the memory, so what is declared must be right
before a kernel is called. What depends on the model, the names of its sensors, is checked when the world is built.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from numbers import Integral, Real
from typing import Any

from dms_core.errors import InputError, choices
from dms_core.validation import plain
from exo_env.estimation.reduced_filter import ESTIMATE
from exo_env.kernel_checks import check_kernel, uses
from exo_env.patient.patient import FIELDS
from exo_env.tasks.observation.channels import Channel, Parts, Reading

INFO_NAMES = (
    "reward_terms", "reward_weights", "time", "solver_failed", "event",
    "patient", "load", "ability", "reference", "initial_angle_deg",
    "final_obs", "final_info", "episode", "TimeLimit.truncated", "terminal_observation",
)  # fmt: skip
"""Names that `info` has already: those of a step, of a reset, which a batch puts beside them, and Gymnasium's own."""
FEWEST_PIECES = 3
"""Pieces that the signal of a movement has at least."""
_beginnings: list[tuple[Any, Callable[[Parts], list[Reading]]]] = []


def begins(places: Any, declare: Callable[[Parts], list[Reading]]) -> None:
    """Say which readings a task begins with whose kernels use `places`.

    Args:
        places: tuple of places that kernels use.
        declare: gives these readings for the parts of an ecosystem.
    """
    _beginnings.append((places, declare))


def repeated(names: Iterable[str]) -> str | None:
    """The first name that occurs a second time, None where all differ."""
    seen = set[str]()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


def _words(value: Any) -> bool:
    """Whether a value is a tuple or list of words."""
    return isinstance(value, tuple | list) and all(isinstance(x, str) for x in value)


def _is_time(value: Any) -> bool:
    """Whether a value is a finite number from 0."""
    return isinstance(value, Real) and 0.0 <= float(value) < math.inf


def check_readings(task: str, readings: Sequence[Reading]) -> None:
    """Check each reading by itself and that their names differ.

    Args:
        task: name of the task.
        readings: what it declares.

    Raises:
        InputError: one of them is not possible.
    """
    for r in readings:
        who = f"{task}: reading '{r.name}'"
        if not _words(r.labels) or not r.labels or repeated(r.labels) is not None:
            raise InputError(f"{who}: labels = {r.labels!r}; expected a tuple of different words, at least one.")
        if not _words(r.sensors) or len(r.sensors) not in (0, len(r.labels)):
            raise InputError(
                f"{who}: sensors = {r.sensors!r}; expected none, or a tuple with one for each of its "
                f"{len(r.labels)} components: {', '.join(r.labels)}."
            )
        if r.trait is not None and r.trait not in FIELDS:
            raise InputError(f"{who}: trait '{r.trait}' is unknown; a patient has {choices(FIELDS)}.")
        if r.trait is not None and (r.sensors or len(r.labels) > 1):
            raise InputError(f"{who} shows the trait '{r.trait}'; expected one component and no sensors.")
        if r.estimate is not None and r.estimate not in ESTIMATE._fields:
            known = choices(ESTIMATE._fields)
            raise InputError(f"{who}: estimate '{r.estimate}' is unknown; the device's filter estimates {known}.")
        if r.estimate is not None and (r.sensors or r.trait or len(r.labels) > 1):
            raise InputError(f"{who} shows the estimate '{r.estimate}'; expected one component, no sensors, no trait.")
    twice = repeated(r.name for r in readings)
    if twice is not None:
        raise InputError(f"{task}: reading '{twice}' is declared twice; expected different names.")


def _check_channel(who: str, channel: Channel, readings: Collection[str]) -> None:
    if channel.source not in readings:
        raise InputError(f"{who} shows reading '{channel.source}', which is unknown; there are {choices(readings)}.")
    if not (math.isfinite(channel.scale) and channel.scale > 0.0):
        raise InputError(f"{who}: scale = {channel.scale}; expected a finite number above 0.")
    if not channel.low < channel.high:
        raise InputError(f"{who}: low = {channel.low}, high = {channel.high}; expected low below high.")


def check_groups(task: str, groups: Mapping[str, Sequence[Channel]], readings: Collection[str]) -> None:
    """Check the groups of channels.

    Args:
        task: name of the task.
        groups: channels of each group.
        readings: names of the task's readings.

    Raises:
        InputError: a group has no channel or one twice, or a channel shows nothing that there is.
    """
    if not groups:
        raise InputError(f"{task}: declared_groups gives no group; expected at least one, with the channels it has.")
    for group, channels in groups.items():
        if not channels:
            raise InputError(f"{task}: group '{group}' is empty; expected at least one channel.")
        twice = repeated(c.name for c in channels)
        if twice is not None:
            raise InputError(f"{task}: group '{group}' has channel '{twice}' twice; expected different names.")
        for name in (group, *(c.name for c in channels)):
            if not name or "." in name:
                raise InputError(f"{task}: group '{group}': name '{name}' of group or channel; expected no dot in it.")
        for channel in channels:
            _check_channel(f"{task}: channel '{group}.{channel.name}'", channel, readings)


def check_reported(task: str, reported: Iterable[Any], readings: Mapping[str, Reading]) -> None:
    """Check what `info` is to have.

    Args:
        task: name of the task.
        reported: its `Reported` numbers.
        readings: its readings by name.

    Raises:
        InputError: a name is taken, or a reading is unknown or has several components.
    """
    names = [x.name for x in reported]
    twice = repeated(names)
    if twice is not None:
        raise InputError(f"{task}: reported number '{twice}' is declared twice; expected different names.")
    for x in reported:
        who = f"{task}: reported number '{x.name}'"
        if x.name in INFO_NAMES or x.name.startswith("_"):
            raise InputError(
                f"{who}: info has that name already; expected none of {choices(INFO_NAMES)}, and no underscore first."
            )
        if x.reading not in readings:
            raise InputError(f"{who}: reading '{x.reading}' is unknown; there are {choices(readings)}.")
        if len(readings[x.reading].labels) != 1:
            labels = ", ".join(readings[x.reading].labels)
            raise InputError(f"{who}: reading '{x.reading}' has the components {labels}; expected a reading of one.")


def check_beginning(task: str, kernel: Any, readings: Sequence[Reading], parts: Parts) -> None:
    """Check that the readings stand where a kernel takes them from.

    Args:
        task: name of the task.
        kernel: compiled function.
        readings: readings of the task.
        parts: what the readings were declared for.

    Raises:
        InputError: the kernel, or what it calls, uses places of readings that the task does not begin with.
    """
    found = [(r.name, len(r.labels)) for r in readings]
    for places, declare in _beginnings:
        expected = [(r.name, len(r.labels)) for r in declare(parts)]
        if uses(kernel, places) and found[: len(expected)] != expected:
            k = next(i for i, right in enumerate(expected) if found[i : i + 1] != [right])
            name, size = expected[k]
            got = f"'{found[k][0]}' of size {found[k][1]}" if k < len(found) else "none"
            raise InputError(
                f"{task}: kernel '{kernel.py_func.__name__}' takes the readings of {declare.__name__} from their "
                f"places; expected '{name}' of size {size} as reading number {k + 1}, got {got}. Begin the list with "
                f"{declare.__name__}(parts) and put others behind."
            )


def check_task(task: Any) -> None:
    """Check all that a task declares.

    Args:
        task: a `Task`, whose readings and groups are there.

    Raises:
        InputError: names the task, the culprit and what would be right.
    """
    name = type(task).__name__
    events = task.events
    if not _words(events) or repeated(events) is not None:
        raise InputError(f"{name}: events = {events!r}; expected a tuple of different words.")
    ahead = task.preview
    if not isinstance(ahead, tuple | list) or not all(_is_time(x) for x in ahead):
        raise InputError(f"{name}: preview = {plain(ahead)!r}; expected a tuple of finite times from 0 s.")
    check_readings(name, task.readings)
    check_groups(name, task.groups, {r.name: r for r in task.readings})
    check_reported(name, task.reported, {r.name: r for r in task.readings})
    for kernel in (check_kernel(task, "read"), check_kernel(task, "judge")):
        check_beginning(name, kernel, task.readings, task.parts)


def check_sensors(task: str, readings: Sequence[Reading], sensors: Collection[str]) -> None:
    """Check that the model has the sensors that readings copy.

    Args:
        task: name of the task.
        readings: its readings.
        sensors: components of the model's sensors.

    Raises:
        InputError: one of them is unknown.
    """
    for r in readings:
        for sensor in r.sensors:
            if sensor not in sensors:
                raise InputError(
                    f"{task}: reading '{r.name}': sensor '{sensor}' is unknown; the model has {choices(sensors)}."
                )


def check_movement(movement: Any) -> None:
    """Check kernel and pieces of a `Movement`.

    Raises:
        InputError: the kernel is none, or there are fewer than three pieces.
    """
    check_kernel(movement, "kernel")
    pieces = movement.pieces
    if not isinstance(pieces, Integral) or pieces < FEWEST_PIECES:
        raise InputError(
            f"{type(movement).__name__}: pieces = {plain(pieces)!r}; expected a whole number from {FEWEST_PIECES}; a "
            "movement that needs fewer repeats its last piece."
        )

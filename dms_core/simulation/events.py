"""Events: a run ends exactly where a sensor passes a value, such as a contact's gap that closes.

Steps are looked at one by one, only in a run that asks for it. Where the sensor has passed the value within a step, the
world is put back to the step's begin, and the time is found by advancing anew from there (Brent's method), so that the
last step lands on the event. The method starts afresh behind it, as behind a jump of an input: what changes there, a
force that begins, is no longer within a step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq

from dms_core.errors import InputError, choices
from dms_core.results import Result
from dms_core.simulation.state import COUNTS

SHARPNESS = 1e-13
"""Error of an event's time, over the time reached and the step, whichever is more."""


class Crossing(NamedTuple):
    """A sensor component that passes a value."""

    sensor: str
    """Full name of the component, such as 'touch.gap'."""
    way: Literal[-1, 0, 1] = -1
    """-1 falling, 1 rising, 0 either."""
    value: float = 0.0


def checked(world: Any, stop_at: Crossing | Sequence[Crossing]) -> list[tuple[int, Crossing]]:
    """The crossings with the places of their components among the sensors.

    Raises:
        InputError: a component does not exist, or a value is not finite.
    """
    names = [name for name, _ in world.model.layout.outputs]
    found = []
    for crossing in [stop_at] if isinstance(stop_at, Crossing) else stop_at:
        if crossing.sensor not in names:
            raise InputError(
                f"stop_at: sensor component '{crossing.sensor}' does not exist. Declared: {choices(names)}."
            )
        if crossing.way not in (-1, 0, 1):
            raise InputError(f"stop_at: '{crossing.sensor}': way: Expected -1, 0 or 1, got {crossing.way!r}.")
        if not math.isfinite(crossing.value):
            raise InputError(f"stop_at: '{crossing.sensor}': value: Expected a finite number, got {crossing.value}.")
        found.append((names.index(crossing.sensor), crossing))
    return found


def advance_to_crossing(
    world: Any, t_end: float, stop_at: Crossing | Sequence[Crossing], progress: Callable[[float], None] | None
) -> tuple[Result, Crossing | None]:
    """Step until t_end or the first crossing; gives the result and the crossing that ended it.

    A component that stands on its value at the start passes it only after it has left it.
    """
    watched = checked(world, stop_at)
    if world.state.counts[COUNTS.restart]:
        # Sensors read accelerations and multipliers that belong to the inputs of now.
        world.settle()
        world.state.counts[COUNTS.restart] = 1
    # Where the last call ended on a crossing, it stands on the value to rounding, on either side.
    standing = world.crossing is not None and world.crossed_at == world.time
    ways = [crossing.way for _, crossing in watched]
    on = [standing and crossing == world.crossing for _, crossing in watched]
    result, which = advance_to_zero(world, t_end, lambda: _readings(world, watched), ways, on, progress)
    world.crossed_at = world.time
    return result, None if which is None else watched[which][1]


def _readings(world: Any, watched: list[tuple[int, Crossing]]) -> np.ndarray:
    """Distance of each component from its value."""
    y = world.read()
    return np.array([y[k] - crossing.value for k, crossing in watched])


def advance_to_zero(
    world: Any,
    t_end: float,
    read: Callable[[], np.ndarray],
    ways: Sequence[int],
    on: Sequence[bool],
    progress: Callable[[float], None] | None = None,
) -> tuple[Result, int | None]:
    """Step until t_end or the first zero of any of some quantities; gives the result and which one ended it.

    Args:
        world: a World.
        t_end: end [s].
        read: the quantities at the present of the world, shape (n,).
        ways: -1 for falling, 1 for rising, 0 for either, for each.
        on: whether each stands on 0 now, and has to leave it first.
        progress: called with the time reached.
    """
    before = np.where(on, 0.0, read())
    while world.time < t_end:
        past = world.mark()
        result = world.advance_once(t_end, progress)
        if result is not Result.SUCCESS:
            return result, None
        now = read()
        passed = [k for k, way in enumerate(ways) if _passes(before[k], now[k], way)]
        if passed:
            return _land(world, past, read, passed, before, progress)
        # Where it stands on the value, the side that it came from counts.
        before = np.where(now == 0.0, before, now)
    return Result.SUCCESS, None


def _passes(before: float, now: float, way: int) -> bool:
    """Whether a quantity changes its sign that way; one that was 0 passes nothing."""
    return (way <= 0 and before > 0.0 >= now) or (way >= 0 and before < 0.0 <= now)


def _land(
    world: Any,
    past: Any,
    read: Callable[[], np.ndarray],
    passed: list[int],
    before: np.ndarray,
    progress: Callable[[float], None] | None,
) -> tuple[Result, int | None]:
    """End a step on the first of the zeros that lie within the last one."""
    begin, end = past.time, world.time
    sharp = SHARPNESS * max(abs(end), end - begin)

    def at(t: float, k: int) -> float:
        if t == begin:
            return float(before[k])
        world.rewind(past)
        return float(read()[k]) if world.advance(t) is Result.SUCCESS else math.nan

    times = [float(brentq(at, begin, end, args=(k,), xtol=sharp)) for k in passed]
    first = int(np.argmin(times))
    world.rewind(past)
    result = world.advance(max(times[first], begin + sharp), progress)
    world.state.counts[COUNTS.restart] = 1
    return result, passed[first] if result is Result.SUCCESS else None


def advance_with_impacts(world: Any, t_end: float, contacts: dict[str, str]) -> Result:
    """Step until t_end, landing on every touch-down and giving its speed to the contact.

    With it each impact gives back the declared share of its own speed, however fast it is.

    Args:
        world: a World whose contacts read their impact speeds from inputs.
        t_end: end [s].
        contacts: name of the input of each contact, by the name of its sensor.

    Raises:
        InputError: a sensor or input does not exist.
    """
    falling = [Crossing(f"{sensor}.gap") for sensor in contacts]
    names = [name for name, _ in world.model.layout.outputs]
    while world.time < t_end:
        result = world.advance(t_end, stop_at=falling)
        if result is not Result.SUCCESS or world.crossing is None:
            return result
        sensor = world.crossing.sensor.rpartition(".")[0]
        world.set_input(contacts[sensor], -float(world.read()[names.index(f"{sensor}.rate")]))
    return Result.SUCCESS

"""An observer: the channels that an agent sees, chosen by name, and how well it sees them.

What is asked for is a list of groups ("device"), of single channels ("privileged.load"), or of both; a channel that
stands in two groups may be seen twice, under both names.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from dms_core.errors import InputError, choices
from dms_core.validation import plain
from exo_env.settings import given_mapping
from exo_env.streams import streams
from exo_env.tasks.observation.channels import Channel, Imperfection, Reading, Slice, first_places
from exo_env.tasks.observation.estimates import SENSORS
from exo_env.tasks.observation.noise import IMPERFECTION


class Observer:
    """The channels of an observation and their imperfections.

    Args:
        observation: names of groups, or of single channels as "group.channel".
        readings: readings of the task, in the order of its array.
        groups: channels of each group.
        noise: False for perfect channels, True for the defaults, or a mapping from a channel, by its name or as
            "group.channel", to an Imperfection that replaces its default. A channel that shows an estimate takes none:
            the device's computer knows it as it is. The sensors of the filter behind it do, shown or not.
        period: control period [s].
    """

    def __init__(
        self,
        observation: Sequence[str],
        readings: Sequence[Reading],
        groups: Mapping[str, Sequence[Channel]],
        noise: bool | Mapping[str, Any],
        period: float,
    ) -> None:
        self.channels = _chosen(observation, groups)
        estimates = {r.name for r in readings if r.estimate is not None}
        estimated = [c for _, c in self.channels if c.source in estimates]
        self.device: Observer | None = None
        """What the device's filter sees, where one of the channels shows an estimate: as noisy as an agent sees it."""
        if estimated:
            _check_sensors(estimated[0], groups, {r.name: r for r in readings})
            self.device = Observer(SENSORS, readings, groups, _noise_of(SENSORS, noise), period)
        measured = [x for x in self.channels if x[1] not in estimated] + (self.device.channels if self.device else [])
        self.measured = {f"{group}.{c.name}": c for group, c in measured}
        """Channels whose imperfections count, by "group.channel": those shown but for estimates, and the filter's."""
        self._readings = {r.name: (r, int(place)) for r, place in zip(readings, first_places(readings), strict=False)}
        self.structure = self._slices()
        self.size = self.structure[-1].stop
        self.imperfections = self._table(self._each(noise), period)
        """Rows at the places of noise.IMPERFECTION, shape (size, 7)."""
        sources = [
            (self._readings[c.source][1], part) for (_, c), part in zip(self.channels, self.structure, strict=True)
        ]
        self.columns = np.concatenate([place + np.arange(part.stop - part.start) for place, part in sources])
        """Place of each component in the readings, shape (size,)."""
        self.streams = streams(f"noise.{s.group}.{s.name}.{label}" for s in self.structure for label in s.labels)
        """Random stream of each component's noise, shape (size,)."""

    def _slices(self) -> tuple[Slice, ...]:
        """Where each channel stands in the observation."""
        start, found = 0, []
        for group, c in self.channels:
            reading = self._readings[c.source][0]
            stop = start + len(reading.labels)
            found.append(Slice(group, c.name, reading.labels, start, stop, reading.unit, c.scale, c.low, c.high))
            start = stop
        return tuple(found)

    def _table(self, imperfections: Sequence[Imperfection], period: float) -> np.ndarray:
        rows = []
        for (_, c), i, part in zip(self.channels, imperfections, self.structure, strict=True):
            delay = i.delay / period
            whole = np.floor(delay)
            row = [i.deviation, i.bias, i.quantum, c.scale, c.low, c.high, whole, delay - whole]
            rows += [row] * (part.stop - part.start)
        return np.array(rows, dtype=float)

    def _each(self, noise: bool | Mapping[str, Any]) -> list[Imperfection]:
        """The imperfection of each channel.

        Raises:
            InputError: `noise` is of another kind, or names a channel that is not observed or shows an estimate.
        """
        if isinstance(noise, Mapping):
            for name in noise:
                self._check_measured(name)
            shown = [(group, c) for group, c in self.channels if f"{group}.{c.name}" in self.measured]
            names = _names(shown)
            given = {name: _imperfection(name, value) for name, value in noise.items() if name in names}
            return [
                given.get(f"{group}.{c.name}", given.get(c.name, c.imperfection)) if (group, c) in shown
                else c.imperfection for group, c in self.channels
            ]  # fmt: skip
        if not isinstance(noise, bool):
            raise InputError(
                f"noise = {plain(noise)!r}: expected True, False or a mapping from channels to imperfections."
            )
        return [c.imperfection if noise else Imperfection() for _, c in self.channels]

    def _check_measured(self, name: str) -> None:
        """Check that there is a channel of this name, or "group.channel", whose imperfection counts.

        Raises:
            InputError: there is none, or all of this name show estimates.
        """
        measured = [(key.partition(".")[0], c) for key, c in self.measured.items()]
        if name in _names(measured):
            return
        fault = (
            "shows an estimate, which has no noise of its own" if name in _names(self.channels) else "is not observed"
        )
        there_are = choices({c.name for _, c in measured})
        raise InputError(f"noise: channel '{name}' {fault}; there are {there_are}.")

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest observation, shape (size,), float32."""
        low, high, scale = (self.imperfections[:, k] for k in (IMPERFECTION.low, IMPERFECTION.high, IMPERFECTION.scale))
        return (low / scale).astype(np.float32), (high / scale).astype(np.float32)

    def memory(self) -> np.ndarray:
        """Room for the past readings of one world, shape (depth, size)."""
        return np.zeros((int(self.imperfections[:, IMPERFECTION.whole].max()) + 2, self.size))


def _check_sensors(shown: Channel, groups: Mapping[str, Sequence[Channel]], readings: Mapping[str, Reading]) -> None:
    """Check that a task has what the device's filter sees.

    Raises:
        InputError: a channel of the device is missing, or shows several numbers.
    """
    known = {f"{group}.{c.name}": c for group, channels in groups.items() for c in channels}
    for name in SENSORS:
        if name not in known or len(readings[known[name].source].labels) != 1:
            raise InputError(
                f"observation: channel '{shown.name}' shows an estimate, which the device makes of "
                f"{', '.join(SENSORS)}; expected a task with these channels, of one number each, and '{name}' is none."
            )


def _names(channels: Iterable[tuple[str, Channel]]) -> set[str]:
    """Names by which the noise of channels may be given."""
    return {name for group, c in channels for name in (c.name, f"{group}.{c.name}")}


def _noise_of(channels: Iterable[str], noise: bool | Mapping[str, Any]) -> bool | Mapping[str, Any]:
    """What is given of the noise of some channels, "group.channel"."""
    if not isinstance(noise, Mapping):
        return noise
    names = {name for channel in channels for name in (channel, channel.partition(".")[2])}
    return {name: value for name, value in noise.items() if name in names}


def _imperfection(channel: str, given: Any) -> Imperfection:
    """What a user gives for a channel.

    Raises:
        InputError: it is no mapping, or one of its numbers is not possible.
    """
    if isinstance(given, Imperfection):
        return given
    numbers = given_mapping(f"noise: {channel}", given, f"some of {choices(Imperfection.model_fields)}")
    try:
        return Imperfection(**numbers)
    except InputError as error:
        raise InputError(f"noise: {channel}: {error}") from None


def _chosen(names: Sequence[str], groups: Mapping[str, Sequence[Channel]]) -> list[tuple[str, Channel]]:
    """(group, channel) of what is asked for, in order.

    Raises:
        InputError: a name is unknown, stands twice, or nothing is asked for.
    """
    words = isinstance(names, Sequence) and not isinstance(names, str) and all(isinstance(x, str) for x in names)
    if not words or not names or len(set(names)) < len(names):
        raise InputError(
            f"observation = {plain(names)!r}: expected a list of different groups of {choices(groups)}, or of channels "
            "as 'group.channel'."
        )
    found: list[tuple[str, Channel]] = []
    for name in names:
        group, dot, single = name.partition(".")
        if group not in groups:
            raise InputError(f"observation: group '{group}' is unknown; there are {choices(groups)}.")
        known = {c.name: c for c in groups[group]}
        if dot and single not in known:
            raise InputError(f"observation: group '{group}' has no channel '{single}'; it has {choices(known)}.")
        found += [(group, c) for c in ([known[single]] if dot else groups[group])]
    if len(set(found)) < len(found):
        raise InputError(f"observation = {list(names)!r} asks for a channel twice.")
    return found

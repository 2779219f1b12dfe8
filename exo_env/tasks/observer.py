"""What an agent sees: channels in named groups, each an imperfect sensor of the core's virtual sensors.

A reading goes through delay, noise, quantisation and the sensor's range, in this order, and is then divided by the
channel's scale, so that observations are of order 1 (`Channel.scale` and `unit` tell what a 1 is).
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from pydantic import Field

from dms_core.errors import InputError, choices
from exo_env.ecosystem.arm import MUSCLES
from exo_env.jit import compiled
from exo_env.patient.patient import PATIENT, Patient
from exo_env.patient.slacking import MOST_EFFORT
from exo_env.settings import Settings

PREVIEW = (0.1, 0.2, 0.4)
"""How far ahead the reference is shown [s]; assumed."""


class Imperfection(Settings):
    """What separates a channel from the truth."""

    deviation: float = Field(default=0.0, ge=0.0, description="standard deviation of white noise [unit of the channel]")
    delay: float = Field(default=0.0, ge=0.0, le=0.5, description="[s]; linear between two control periods")
    quantum: float = Field(default=0.0, ge=0.0, description="smallest step [unit of the channel]; 0: none")


@dataclass(frozen=True)
class Channel:
    """One kind of reading."""

    name: str
    unit: str
    scale: float
    """Value in `unit` that is shown as 1."""
    low: float
    """Range of the sensor [unit]."""
    high: float
    labels: tuple[str, ...] = ("",)
    """One a component."""
    imperfection: Imperfection = Imperfection()
    """Unless the user says otherwise."""


@dataclass(frozen=True)
class Slice:
    """Where a channel stands in the observation."""

    group: str
    name: str
    labels: tuple[str, ...]
    start: int
    stop: int
    unit: str
    scale: float
    """Value in `unit` that is shown as 1."""
    low: float
    """Least value shown [unit]."""
    high: float
    """Greatest value shown [unit]."""

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def patient_channels() -> list[Channel]:
    """One for each number of the patient that the effort reads, over the range that `Patient` accepts."""
    found = []
    for name in (*PATIENT._fields, "body_mass", "height", "strength", "expected_load"):
        limits: dict[str, float] = {}
        for rule in Patient.model_fields[name].metadata:
            limits |= {k: float(getattr(rule, k)) for k in ("ge", "gt", "le") if hasattr(rule, k)}
        high = limits["le"]
        low = limits.get("ge", limits.get("gt", 0.0))
        found.append(Channel(name, UNITS.get(name, "-"), high, low, high))
    return found


UNITS = {
    "neural_delay": "s", "electromechanical_delay": "s", "spasticity_flexors": "s/rad", "spasticity_extensors": "s/rad",
    "stretch_threshold": "rad/s", "stretch_delay": "s", "tremor_frequency": "Hz", "tremor_width": "Hz",
    "fatigue_rate": "1/s", "recovery_rate": "1/s", "slacking_rate": "1/s",
    "effort_recovery": "1/(s rad)", "feedback_gain": "1/rad", "feedback_delay": "s", "body_mass": "kg", "height": "m",
}  # fmt: skip

# Noise, assumed: an encoder of 12 bits, its filtered difference, rope and guide force sensors of half a per cent, and
# an EMG envelope whose noise is 3 % of the maximum.
GROUPS: dict[str, list[Channel]] = {
    "device": [
        Channel("angle", "rad", 1.0, -0.5, 3.0, imperfection=Imperfection(quantum=0.0015)),
        Channel("rate", "rad/s", 1.0, -20.0, 20.0, imperfection=Imperfection(deviation=0.02)),
        Channel("tension", "N", 100.0, 0.0, 1600.0, ("agonist", "antagonist"), Imperfection(deviation=1.0)),
        Channel("guide_force", "N", 10.0, -500.0, 500.0, imperfection=Imperfection(deviation=0.5)),
        Channel("reference", "rad", 1.0, -0.5, 3.0),
        Channel("reference_rate", "rad/s", 1.0, -20.0, 20.0),
        Channel("preview", "rad", 1.0, -0.5, 3.0, tuple(f"in {t} s" for t in PREVIEW)),
        Channel("last_action", "-", 1.0, -1.0, 1.0, ("first", "second")),
    ],
    "emg": [Channel("emg", "-", 1.0, 0.0, 1.0, MUSCLES, Imperfection(deviation=0.03))],
    "privileged": [
        *patient_channels(),
        Channel("load", "kg", 1.0, 0.0, 50.0),
        Channel("muscle_force", "N", 500.0, 0.0, 10000.0, MUSCLES),
        Channel("fatigued", "-", 1.0, 0.0, 1.0, MUSCLES),
        Channel("effort", "-", 1.0, 0.0, MOST_EFFORT),
        Channel("device_share", "-", 1.0, 0.0, 1.0),
    ],
}
"""Channels of each group, in the order of the observation."""

_ALL = [c for channels in GROUPS.values() for c in channels]
_STARTS = np.concatenate([[0], np.cumsum([len(c.labels) for c in _ALL])])
TRUTH_SIZE = int(_STARTS[-1])
TRUTH: Any = namedtuple("TRUTH", [c.name for c in _ALL])(*_STARTS[:-1].tolist())
"""Place of each channel in the vector of all."""
OF_PATIENT = tuple((int(getattr(TRUTH, c.name)), c.name) for c in patient_channels())
"""Place and field of each number of the patient in it."""
DEVIATION, QUANTUM, SCALE, LOW, HIGH, WHOLE, PART = range(7)


class Observer:
    """Turns true readings into observations.

    Args:
        groups: names of the groups.
        noise: False for perfect sensors, True for the defaults, or a mapping from a channel to an Imperfection that
            replaces its default.
        period: control period [s].
    """

    def __init__(self, groups: Sequence[str], noise: bool | Mapping[str, Any], period: float) -> None:
        if isinstance(groups, str) or not groups or len(set(groups)) < len(groups):
            raise InputError(f"observation = {groups!r}; a list of different groups of {choices(GROUPS)} is wanted.")
        for group in groups:
            if group not in GROUPS:
                raise InputError(f"observation: group '{group}' is unknown; there are {choices(GROUPS)}.")
        self.channels = [(group, channel) for group in groups for channel in GROUPS[group]]
        self.structure = self._slices()
        self.size = self.structure[-1].stop
        found = self._imperfections(noise)
        sizes = [len(c.labels) for _, c in self.channels]

        def spread(values: list[float]) -> np.ndarray:
            return np.repeat(np.array(values, dtype=float), sizes)

        delay = np.array([i.delay for i in found]) / period
        whole = np.floor(delay)
        self.sensors = np.stack(
            [
                spread([i.deviation for i in found]), spread([i.quantum for i in found]),
                spread([c.scale for _, c in self.channels]), spread([c.low for _, c in self.channels]),
                spread([c.high for _, c in self.channels]), spread(list(whole)), spread(list(delay - whole)),
            ],
            axis=1,
        )  # fmt: skip
        """Columns DEVIATION, QUANTUM, SCALE, LOW, HIGH, WHOLE (periods of delay) and PART (of another)."""
        self.columns = np.concatenate([getattr(TRUTH, c.name) + np.arange(len(c.labels)) for _, c in self.channels])

    def _slices(self) -> tuple[Slice, ...]:
        start, found = 0, []
        for group, c in self.channels:
            stop = start + len(c.labels)
            found.append(Slice(group, c.name, c.labels, start, stop, c.unit, c.scale, c.low, c.high))
            start = stop
        return tuple(found)

    def _imperfections(self, noise: bool | Mapping[str, Any]) -> list[Imperfection]:
        """Of each channel."""
        names = {c.name for _, c in self.channels}
        if isinstance(noise, Mapping):
            for name in noise:
                if name not in names:
                    raise InputError(f"noise: channel '{name}' is not observed; there are {choices(names)}.")
            given = {name: Imperfection(**dict(value)) for name, value in noise.items()}
            return [given.get(c.name, c.imperfection) for _, c in self.channels]
        if not isinstance(noise, bool):
            raise InputError(f"noise = {noise!r}; True, False or a mapping from channels to imperfections is wanted.")
        return [c.imperfection if noise else Imperfection() for _, c in self.channels]

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest observation, shape (size,), float32."""
        low, high, scale = (self.sensors[:, k] for k in (LOW, HIGH, SCALE))
        return (low / scale).astype(np.float32), (high / scale).astype(np.float32)

    def memory(self) -> np.ndarray:
        """For the past readings of one world, shape (depth, size)."""
        return np.zeros((int(self.sensors[:, WHOLE].max()) + 2, self.size))


@compiled
def imperfect(truth, columns, sensors, memory, noise, first, out):
    """What sensors make of the truth, in their scales.

    Args:
        truth: every channel [unit of the channel].
        columns: places in it of what is observed, shape (n,).
        sensors: `Observer.sensors`, shape (n, 7).
        memory: past readings, newest first, shape (depth, n); changed.
        noise: standard normal numbers, shape (n,).
        first: as if the truth had been so for long.
        out: shape (n,).
    """
    depth = memory.shape[0]
    for i in range(columns.shape[0]):
        for k in range(depth - 1, 0, -1):
            memory[k, i] = truth[columns[i]] if first else memory[k - 1, i]
        memory[0, i] = truth[columns[i]]
        whole, s = int(sensors[i, WHOLE]), sensors[i]
        near, far = memory[whole, i], memory[whole + 1, i]
        shown = near + s[PART] * (far - near) + s[DEVIATION] * noise[i]
        if s[QUANTUM] > 0.0:
            shown = round(shown / s[QUANTUM]) * s[QUANTUM]
        out[i] = min(max(shown, s[LOW]), s[HIGH]) / s[SCALE]

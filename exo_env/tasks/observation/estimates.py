"""Readings and channels of what a worn device can know of its wearer: the group `estimated`.

A filter of the device (estimation/reduced_filter.py) makes them of what the device measures: hinge angle, its rate and
the cuff's force, as the channels of the group `device` show them, with the same noise; no EMG, no truth and no number
of the patient. It runs where an agent is shown one of them, and its readings are worth something only there.
"""

from __future__ import annotations

from exo_env.estimation.reduced_filter import DEVIATION, ESTIMATE
from exo_env.tasks.observation.channels import Channel, Reading

SENSORS = ("device.angle", "device.rate", "device.guide_force")
"""Channels that the filter sees, in the order of SENSED."""
GROUP = "estimated"
_SHOWN = {
    "others_moment": ("Nm", 10.0, 500.0),
    "muscle_moment": ("Nm", 10.0, 500.0),
    "intended_moment": ("Nm", 10.0, 500.0),
    "load": ("kg", 1.0, 50.0),
    "effort": ("-", 1.0, 100.0),
}
"""Unit, scale and greatest value of each estimate."""


def estimated_readings() -> list[Reading]:
    """A reading for each estimate and for each standard deviation, of names that begin with `estimated_`."""
    return [Reading(f"{GROUP}_{name}", _shown(name)[0], estimate=name) for name in ESTIMATE._fields]


def estimated_channels() -> list[Channel]:
    """A channel for each of these: the device's computer knows them as they are, so that they have no imperfection."""
    channels = []
    for name in ESTIMATE._fields:
        _, scale, most = _shown(name)
        low = 0.0 if name.endswith(DEVIATION) or name == "load" else -most
        channels.append(Channel(name, scale, low, most, reading=f"{GROUP}_{name}"))
    return channels


def _shown(name: str) -> tuple[str, float, float]:
    """Unit, scale and greatest value of an estimate or of its deviation."""
    return _SHOWN[name.removesuffix(DEVIATION)]

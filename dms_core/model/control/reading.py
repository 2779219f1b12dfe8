"""A sensor component that an element reads, outside compiled code."""

from __future__ import annotations

import numpy as np

from dms_core.errors import ModelError
from dms_core.model.element import COMPOSITIONS


def read_at_rest(system, component: str, q: np.ndarray, u: np.ndarray) -> float:
    """The reading with all rates, accelerations and multipliers 0.

    Args:
        system: the declared system.
        component: full name of the sensor component.
        q: local coordinates of the sensor, in front of others.
        u: (value, rate, second derivative) of its inputs, shape (k, 3).

    Raises:
        ModelError: there is no such component.
    """
    for sensor in system.sensors:
        parts = [f"{sensor.name}.{part}" if part else sensor.name for part, _ in sensor.outputs()]
        if component in parts and sensor.composition == COMPOSITIONS.none:
            place = sensor.place(system)
            n, m, k = place.size, len(parts), len(place.inputs)
            rest, y, wide, none = np.zeros(n), np.zeros(m), np.zeros((m, n)), np.zeros((m, 1))
            ip, par = np.array(place.integers, np.int32), np.array(place.numbers, float)
            held = np.ascontiguousarray(u[:k]) if k else np.zeros((0, 3))
            type(sensor).kernel(
                ip, par, np.ascontiguousarray(q[:n]), rest, rest, np.zeros(1), held, 0, y, wide, wide, wide, none,
                np.zeros((m, k)),
            )  # fmt: skip
            return float(y[parts.index(component)])
    raise ModelError(f"sensor component '{component}' does not exist.")

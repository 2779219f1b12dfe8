"""What sensors make of the truth: delay, noise, quantisation and the sensor's range, in this order.

The result is divided by the channel's scale, so that observations are of order 1.
"""

from __future__ import annotations

from exo_env.jit import compiled
from exo_env.places import places

SENSOR = places(("deviation", "quantum", "scale", "low", "high", "whole", "part"))
"""Columns of a table of sensors: what an Imperfection and a Channel say, and the delay in whole control periods and in
the part of another."""


@compiled
def imperfect(truth, columns, sensors, memory, noise, first, out):
    """What sensors make of the truth, in their scales.

    Args:
        truth: every reading [its unit].
        columns: places in it of what is observed, shape (n,).
        sensors: a row for each component, at the places of SENSOR, shape (n, 7).
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
        whole, s = int(sensors[i, SENSOR.whole]), sensors[i]
        near, far = memory[whole, i], memory[whole + 1, i]
        shown = near + s[SENSOR.part] * (far - near) + s[SENSOR.deviation] * noise[i]
        if s[SENSOR.quantum] > 0.0:
            shown = round(shown / s[SENSOR.quantum]) * s[SENSOR.quantum]
        out[i] = min(max(shown, s[SENSOR.low]), s[SENSOR.high]) / s[SENSOR.scale]

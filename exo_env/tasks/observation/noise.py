"""How a channel shows the truth: delay, bias, noise, quantisation and the channel's range, in this order.

The result is divided by the channel's scale, so that observations are of order 1.
"""

from __future__ import annotations

from dms_core.compiled.jit import compiled
from exo_env.places import places

IMPERFECTION = places(("deviation", "bias", "quantum", "scale", "low", "high", "whole", "part"))
"""Columns of a table of imperfections: what an Imperfection and a Channel say, with the delay as a whole
number of control periods and the part of another."""


@compiled
def imperfect(truth, columns, imperfections, memory, noise, first, out):
    """Fill an observation: the truth with its imperfections, over the scales.

    Args:
        truth: every reading [its unit].
        columns: place of each observed component in the truth, shape (n,).
        imperfections: a row for each component, at the places of IMPERFECTION, shape (n, 8).
        memory: past readings, newest first, shape (depth, n); changed.
        noise: standard normal numbers, shape (n,).
        first: True at the start of an episode, where the past is taken to be like the present.
        out: the observation, filled, shape (n,).
    """
    depth = memory.shape[0]
    for i in range(columns.shape[0]):
        for k in range(depth - 1, 0, -1):
            memory[k, i] = truth[columns[i]] if first else memory[k - 1, i]
        memory[0, i] = truth[columns[i]]
        whole, s = int(imperfections[i, IMPERFECTION.whole]), imperfections[i]
        near, far = memory[whole, i], memory[whole + 1, i]
        shown = near + s[IMPERFECTION.part] * (far - near) + s[IMPERFECTION.bias] + s[IMPERFECTION.deviation] * noise[i]
        if s[IMPERFECTION.quantum] > 0.0:
            shown = round(shown / s[IMPERFECTION.quantum]) * s[IMPERFECTION.quantum]
        out[i] = min(max(shown, s[IMPERFECTION.low]), s[IMPERFECTION.high]) / s[IMPERFECTION.scale]

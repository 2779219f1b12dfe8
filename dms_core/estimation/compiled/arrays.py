"""The arrays that a compiled filter holds and works with, packed for compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dms_core.compiled.arena import Packed, fields


class FilterArrays(NamedTuple):
    """n estimated numbers, n_x of them the chart's; of the rest i inputs, then k constants, then biases; c channels."""

    rest: np.ndarray
    """Inputs, constants, biases."""
    mean: np.ndarray
    """That the rest goes back to."""
    factor: np.ndarray
    """Of rest - mean over a period."""
    Q: np.ndarray
    """Covariance that joins over a period, (n, n); that of the motion is written anew in each where there is any."""
    P: np.ndarray
    A: np.ndarray
    half: np.ndarray
    """A P, (n, n)."""
    rows: np.ndarray
    """Rows of the estimated inputs in the signals, (i,)."""
    places: np.ndarray
    """The same inputs among all inputs, (i,)."""
    R: np.ndarray
    """Variance of each channel's noise, (c,)."""
    bias: np.ndarray
    """Place of each channel's bias in the rest, -1 for none."""
    turned: np.ndarray
    """1 for an angle, whose residual is the nearest turn."""
    found_at: np.ndarray
    """Row of each channel among the sensors that are read, (c,)."""
    C: np.ndarray
    """(c, n)."""
    expected: np.ndarray
    innovation: np.ndarray
    """Readings less what was expected before a correction, (c,)."""
    reading: np.ndarray
    """(c,), NaN where a channel tells nothing."""
    x: np.ndarray
    gain: np.ndarray
    """P c^T, (n,)."""
    left: np.ndarray
    """(1 - k c^T) P c^T, (n,)."""
    start: np.ndarray
    """Mean before a correction, (n,)."""
    P_start: np.ndarray
    q: np.ndarray
    """Where a period begins, (n_q,)."""
    v: np.ndarray
    """Rates there, or those that are wanted of the independent coordinates, (n_q,)."""
    begin: np.ndarray
    """When it begins [s], (1,)."""
    intensity: np.ndarray
    """Variance per second of the noise that drives each coordinate of second order, (n_q,); (0,) for none."""
    gram: np.ndarray
    """N^T N, (n_z, n_z)."""
    driven: np.ndarray
    """N^T diag(intensity) N, (n_z, n_z)."""
    order: np.ndarray
    bounded: np.ndarray
    """Places of what is bounded among the n."""
    least: np.ndarray
    most: np.ndarray
    declared: np.ndarray
    """Constants at which the base numbers hold, (k,)."""
    base: np.ndarray
    """Numbers of all dynamic calls there."""
    by_constants: np.ndarray
    """Those numbers by the constants, (k, numbers)."""
    sensor_base: np.ndarray
    """Numbers of the sensors that are read."""
    sensors_by_constants: np.ndarray
    period: np.ndarray
    """Period [s] and number of its steps, (2,)."""
    iterated: np.ndarray
    """1 where a correction is repeated about what it gave, (1,)."""
    nis: np.ndarray
    """Of the last correction, and its readings, (2,)."""


class FilterTables(NamedTuple):
    """All that a step of one filter reads and writes, packed."""

    model: Packed
    state: Packed
    differentials: Packed
    columns: Packed
    chart: Packed
    readings: Packed
    filter: Packed


class Code(NamedTuple):
    """How a step ended."""

    done: int
    unsolved: int
    """A step of the equations, or their rates."""
    steep: int
    """The chart is to be made anew."""
    open: int
    """No state on the constraints is near the corrected one."""
    not_finite: int


FILTER, TABLES, CODE = fields(FilterArrays), fields(FilterTables), fields(Code)

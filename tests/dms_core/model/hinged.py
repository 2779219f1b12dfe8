"""One body that turns about a fixed axis with a known course, and kernels called on it by hand."""

from __future__ import annotations

import numpy as np

from dms_core.model.element import DynamicElement, Placement, Sensor
from dms_core.model.geometry.frames import quaternion, unit

GROUND_BLOCK = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def turning(axis, angle: float, rate: float, acceleration: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Seven coordinates of a body that turns about its centre of mass, at the origin, with their two derivatives.

    p = (cos(x / 2), n sin(x / 2)), differentiated by the chain rule; x is the angle [rad].
    """
    n, half = unit(axis, "axis"), 0.5 * angle
    p_x = 0.5 * np.concatenate([[-np.sin(half)], np.cos(half) * n])
    p_xx = -0.25 * quaternion(axis, angle)
    q, v, a = np.zeros(7), np.zeros(7), np.zeros(7)
    q[3:] = quaternion(axis, angle)
    v[3:] = p_x * rate
    a[3:] = p_x * acceleration + p_xx * rate**2
    return q, v, a


def sensed(sensor: Sensor, placement: Placement, q, v, a) -> np.ndarray:
    """The output y of a sensor without inputs; the output is poisoned, so that what the kernel leaves out shows."""
    m, n = len(sensor.outputs()), placement.size
    y, by, one = np.full(m, np.nan), np.zeros((m, n)), np.zeros((m, 1))
    ip, par = np.array(placement.integers, np.int32), np.array(placement.numbers, float)
    type(sensor).kernel(ip, par, q, v, a, np.zeros(1), np.zeros((1, 3)), 0, y, by, by, by, one, one)
    return y


def rows(element: DynamicElement, placement: Placement, q, v, a, u) -> np.ndarray:
    """Residual rows of a dynamic element."""
    n = placement.size
    r, J = np.zeros(n), np.zeros((n, n))
    ip, par = np.array(placement.integers, np.int32), np.array(placement.numbers, float)
    type(element).kernel(ip, par, q, v, a, u, 0, r, J, J, J)
    return r

"""States of two bodies built from rigid-body motions: what tests of joints and forces start from."""

from __future__ import annotations

import numpy as np

from dms_core.model.geometry.frames import g_matrix, rotation_matrix
from tests.example_elements.kernel_call import KernelCall, Point


def start(call: KernelCall) -> Point:
    """The declared start of the bodies of a call; no rates, multipliers 0, inputs 0."""
    ground = [0.0] * 3 + [1.0] + [0.0] * 3
    q = []
    for name in call.placement.bodies:
        body = call.example.system.body(name)
        own = ground if body is None else [c.start for c in body.coordinates()]
        q += own + ground[len(own) :]
    n = len(q)
    return Point(
        np.array(q), np.zeros(n), np.zeros(n), np.zeros(call.multipliers), np.zeros((len(call.placement.inputs), 3))
    )


def block_rate(q: np.ndarray, centre: np.ndarray, velocity: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Rates of one body's coordinates q, shape (7,), that moves with omega [rad/s] and `velocity` [m/s] at `centre`."""
    rate = np.empty(7)
    rate[:3] = velocity + np.cross(omega, q[:3] - centre)
    rate[3:] = 0.5 * g_matrix(q[3:]).T @ (rotation_matrix(q[3:]).T @ omega)
    return rate


def omega(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Angular velocity in ground axes [rad/s] of one body's block."""
    return rotation_matrix(q[3:]) @ (2.0 * g_matrix(q[3:]) @ v[3:])


def random_motion(q: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Rates of all bodies in q at random rigid-body motions (they keep the Euler parameters' length)."""
    blocks = [
        block_rate(q[o : o + 7], np.zeros(3), rng.normal(size=3), rng.normal(size=3)) for o in range(0, q.size, 7)
    ]
    return np.concatenate(blocks)

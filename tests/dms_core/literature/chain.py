"""Chain of N thin rods hinged end to end about z, released at rest along x.

Rod i: length 1 m, mass 1 kg, inertia about its centre diag(1e-3, 1/12, 1/12) kg m^2 (the first is arbitrary: the
motion is planar). Gravity 9.81 m/s^2 along -y.
"""

from __future__ import annotations

import numpy as np

from dms_core.model import Gravity, Revolute, RigidBody, System
from dms_core.model.element import Force, Sensor
from dms_core.model.geometry.frames import g_matrix, rotation_matrix
from dms_core.model.signals import Input

INERTIA = (1e-3, 1.0 / 12.0, 1.0 / 12.0)
G = 9.81


def chain(n: int, *, forces: tuple[Force, ...] = (), sensors: tuple[Sensor, ...] = (), inputs: tuple[Input, ...] = (),
          spin: float = 0.0) -> System:  # fmt: skip
    """n rods; the whole chain turns as one body at `spin` [rad/s] at the start."""
    rods = [
        RigidBody(
            name=f"rod{i}",
            mass=1.0,
            inertia=INERTIA,
            position=(i + 0.5, 0.0, 0.0),
            velocity=(0.0, spin * (i + 0.5), 0.0),
            angular_velocity=(0.0, 0.0, spin),
        )
        for i in range(n)
    ]
    hinges = [Revolute(name="hinge0", body_j="rod0")]
    hinges += [
        Revolute(name=f"hinge{i}", body_i=f"rod{i - 1}", body_j=f"rod{i}", point_i=(0.5, 0.0, 0.0)) for i in range(1, n)
    ]
    gravity = Gravity(name="gravity", acceleration=(0.0, -G, 0.0))
    return System(
        f"chain of {n}", bodies=rods, constraints=hinges, forces=[gravity, *forces], sensors=sensors, inputs=inputs
    )


def tip(q: np.ndarray) -> np.ndarray:
    """Right end of the last rod [m], shape (3,), from all coordinates."""
    return q[-7:-4] + rotation_matrix(q[-4:]) @ np.array([0.5, 0.0, 0.0])


def energy(q: np.ndarray, v: np.ndarray) -> float:
    """Kinetic and potential energy of all rods [J]."""
    total = 0.0
    for o in range(0, len(q), 7):
        omega = 2.0 * g_matrix(q[o + 3 : o + 7]) @ v[o + 3 : o + 7]
        total += 0.5 * v[o : o + 3] @ v[o : o + 3] + 0.5 * omega @ (np.array(INERTIA) * omega) + G * q[o + 1]
    return total

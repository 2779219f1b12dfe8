"""A sensor component that an element reads: which sensor it is of, and its reading at rest, outside compiled code."""

from __future__ import annotations

import numpy as np

from dms_core.errors import ModelError, choices
from dms_core.model.element import COMPOSITIONS, Sensor


def sensor_of(system, component: str) -> tuple[Sensor, int]:
    """The sensor with a component of that full name, and the component's place.

    Raises:
        ModelError: there is none, or an equation cannot read it.
    """
    names = []
    for sensor in system.sensors:
        for k, (part, _) in enumerate(sensor.outputs()):
            names.append(f"{sensor.name}.{part}" if part else sensor.name)
            if names[-1] == component:
                _check_readable(system, sensor, component)
                return sensor, k
    raise ModelError(f"sensor component '{component}' does not exist. Declared: {choices(names)}.")


def _check_readable(system, sensor: Sensor, component: str) -> None:
    """Refuse sensors of constraint forces, and of sums that no equation evaluates.

    Constraint forces enter the equations as phi_q^T lam alone. An output that acts at once on what it reads of them is
    in a loop with itself, M vdot + phi_q^T lam = f(y(lam)), which for some gain has no solution; and lam is not unique
    where constraints are redundant, whose independent rows may change along a motion.
    """
    named, place = f"sensor component '{component}'", sensor.place(system)
    if place.constraint:
        raise ModelError(
            f"{named} is a force of the constraint '{place.constraint}', which is solved for together with the "
            "accelerations: a controller that reads it would be in a loop with its own output, and a share of "
            "redundant constraints is not even unique. Measure it as a load cell does, on a part that gives way: put a "
            "bushing with a bushing_load, a beam with a beam_load, or an elastic_rope with a rope_sensor, into the "
            "path of the force; its stiffness and damping are the cell's low-pass."
        )
    if sensor.composition != COMPOSITIONS.none:
        raise ModelError(
            f"{named} is composed from the forces of other elements ({', '.join(place.sources)}), which only results "
            "evaluate. Expected a sensor of one element: a bushing_load, beam_load, rope_sensor, muscle_sensor or "
            "contact_sensor, or one of positions, rates and states, of which a state_space makes a spring's force."
        )


def read_at_rest(system, component: str, q: np.ndarray, u: np.ndarray) -> float:
    """The reading with all rates, accelerations and multipliers 0.

    Args:
        system: the declared system.
        component: full name of the sensor component.
        q: local coordinates of the sensor, in front of others.
        u: (value, rate, second derivative) of its inputs, shape (k, 3).

    Raises:
        ModelError: there is no such component, or an equation cannot read it.
    """
    sensor, part = sensor_of(system, component)
    place = sensor.place(system)
    n, m, k = place.size, len(sensor.outputs()), len(place.inputs)
    rest, y, wide, none = np.zeros(n), np.zeros(m), np.zeros((m, n)), np.zeros((m, 1))
    ip, par = np.array(place.integers, np.int32), np.array(place.numbers, float)
    held = np.ascontiguousarray(u[:k]) if k else np.zeros((0, 3))
    type(sensor).kernel(
        ip, par, np.ascontiguousarray(q[:n]), rest, rest, np.zeros(1), held, 0, y, wide, wide, wide, none,
        np.zeros((m, k)),
    )  # fmt: skip
    return float(y[part])

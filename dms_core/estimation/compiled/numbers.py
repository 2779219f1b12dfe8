"""Estimated constants in compiled code: a declared number that moves the kernels' numbers in a straight line.

    numbers(p) = base + sum of (p_k - declared_k) d numbers / d p_k

as a mass, a stiffness or a muscle's strength does. With them go both sides of the central differences by which a step
is differentiated by p_k.
"""

from __future__ import annotations

import numpy as np

from dms_core.assembly.derivatives.input_derivatives import STEP
from dms_core.assembly.derivatives.parameter_derivatives import Direction, declared_number, numbers_with
from dms_core.assembly.model import Model
from dms_core.assembly.readings.sensing import SENSING
from dms_core.assembly.tables import CALLS, MODEL, SIGNALS
from dms_core.compiled.arena import floats, inner, ints, matrix, table_at
from dms_core.compiled.jit import compiled
from dms_core.estimation.compiled.arrays import FILTER, TABLES
from dms_core.sensitivity.tangents.reading_tables import READING, READINGS, Reading
from dms_core.sensitivity.tangents.tables import DIFFERENTIALS, MOVEMENT, Movement
from dms_core.simulation.state import STATE

READING_FIELDS, MOVEMENT_FIELDS = len(Reading._fields), len(Movement._fields)
AWAY = 0.1
"""Distance at which a straight line is looked for, over the number."""
STRAIGHT = 1e-12
"""Departure from it, over the size of what moves, that is rounding."""


def straight_directions(model: Model, constants: list[tuple[str, str]]) -> list[Direction] | None:
    """What each constant moves; None where one moves a constraint, or numbers not in a straight line."""
    if not constants:
        return []
    declared = {key: declared_number(model.system, *key) for key in constants}
    base, far, found = numbers_with(model.layout, declared), dict[tuple[str, str], float](), list[Direction]()
    sums = [x.copy() for x in base]
    for key, p in declared.items():
        size = AWAY * (abs(p) or 1.0)
        high, low = (numbers_with(model.layout, {**declared, key: p + sign * size}) for sign in (1.0, -1.0))
        slopes = [0.5 * (a - b) / size for a, b in zip(high, low, strict=True)]
        h = STEP * (abs(p) or 1.0)
        found.append(Direction(h, *(h * slope for slope in slopes)))
        far[key] = p + size
        sums = [total + size * slope for total, slope in zip(sums, slopes, strict=True)]
    at_once = numbers_with(model.layout, {**declared, **far})
    if any(direction.constraints.any() for direction in found):
        return None
    for reached, wanted, start in zip(sums, at_once, base, strict=True):
        if not np.all(np.abs(reached - wanted) <= STRAIGHT * (np.abs(wanted) + np.abs(start))):
            return None
    return found


@compiled
def _put_sides(high, low, base, slopes, step):
    """Numbers moved to both sides."""
    for i in range(base.shape[0]):
        high[i], low[i] = base[i] + step * slopes[i], base[i] - step * slopes[i]


@compiled
def put_constants(t):
    """The constants of the rest into the numbers of the model, of its sensors, and of all that is moved."""
    f, r = inner(t, TABLES.filter), inner(t, TABLES.readings)
    declared, rest, first = floats(f, FILTER.declared), floats(f, FILTER.rest), ints(f, FILTER.places).shape[0]
    if declared.shape[0] == 0:
        return
    numbers = floats(inner(inner(t, TABLES.model), MODEL.dynamics), CALLS.par)
    sensors = floats(inner(inner(r, READINGS.sensing), SENSING.sensors), CALLS.par)
    base, by = floats(f, FILTER.base), matrix(f, FILTER.by_constants)
    sensor_base, sensors_by = floats(f, FILTER.sensor_base), matrix(f, FILTER.sensors_by_constants)
    for i in range(numbers.shape[0]):
        numbers[i] = base[i]
    for i in range(sensors.shape[0]):
        sensors[i] = sensor_base[i]
    for k in range(declared.shape[0]):
        change = rest[first + k] - declared[k]
        for i in range(numbers.shape[0]):
            numbers[i] += by[k, i] * change
        for i in range(sensors.shape[0]):
            sensors[i] += sensors_by[k, i] * change
    movements = ints(inner(t, TABLES.differentials), DIFFERENTIALS.movements)
    for k in range(declared.shape[0]):
        move = table_at(movements[k], MOVEMENT_FIELDS)
        reading = table_at(ints(r, READINGS.moved)[k], READING_FIELDS)
        step = floats(move, MOVEMENT.step)[0]
        high, low = inner(reading, READING.high), inner(reading, READING.low)
        _put_sides(
            floats(inner(move, MOVEMENT.high_dynamics), CALLS.par),
            floats(inner(move, MOVEMENT.low_dynamics), CALLS.par), numbers, by[k], step,
        )  # fmt: skip
        _put_sides(
            floats(inner(high, SENSING.dynamics), CALLS.par), floats(inner(low, SENSING.dynamics), CALLS.par),
            numbers, by[k], step,
        )  # fmt: skip
        _put_sides(
            floats(inner(high, SENSING.sensors), CALLS.par), floats(inner(low, SENSING.sensors), CALLS.par),
            sensors, sensors_by[k], step,
        )  # fmt: skip


@compiled
def hold_inputs(t):
    """The estimated inputs into the signals."""
    s, f = inner(t, TABLES.state), inner(t, TABLES.filter)
    c, rows, rest = matrix(inner(s, STATE.signals), SIGNALS.c), ints(f, FILTER.rows), floats(f, FILTER.rest)
    for i in range(rows.shape[0]):
        c[rows[i], 0] = rest[i]


@compiled
def put_rest(t):
    """Inputs and constants of the rest into what the equations read."""
    hold_inputs(t)
    put_constants(t)

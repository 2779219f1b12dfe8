"""Sensors over given states and their derivatives by q, v, vdot, lam and u (paper eq. 5 and 6).

A simple sensor has a kernel; others are composed from those of other elements (composed_sensors.py).
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from dms_core.assembly.layout import Layout
from dms_core.assembly.local import evaluate_sensor, views
from dms_core.assembly.readings.composed_sensors import joint_moment, joint_moment_partials, reaction, reaction_partials
from dms_core.assembly.readings.force_loads import force_load, force_load_partials
from dms_core.assembly.residual import evaluate_inputs
from dms_core.assembly.tables import CALLS, WORK
from dms_core.compiled import side_by_side
from dms_core.compiled.arena import Packed, fields, floats, indices, inner, ints, matrix
from dms_core.compiled.calls import TABLE_CALL, address, call_with_table
from dms_core.compiled.jit import compiled
from dms_core.model.element import COMPOSITIONS


class Composition(NamedTuple):
    """What each sensor reads besides the state."""

    kind: np.ndarray
    """`COMPOSITIONS.none` for a sensor with a kernel, or which function of composed_sensors.py evaluates it."""
    constraint: np.ndarray
    """Constraint call whose multipliers it reads, -1 for none."""
    source: np.ndarray
    """Dynamic calls that it sums, all sensors' behind each other."""
    source_ptr: np.ndarray


class Sensing(NamedTuple):
    """What it takes to read the sensors of a state, packed; `work` is for one reader at a time."""

    dynamics: Packed
    constraints: Packed
    sensors: Packed
    composed: Packed
    work: Packed
    evaluation: np.ndarray
    """Address of the function that evaluates all sensors of such a table, shape (1,)."""


class Partials(NamedTuple):
    """Derivatives of all sensor components at one state, dense.

    Shapes (n_y, n_q + 7) three times, (n_y, n_phi), (n_y, n_u).

    What an input does to a joint moment through one of its elements is not in u here: `evaluate_partials` knows sensors
    only, and InputDerivatives.of_moments (input_derivatives.py) gives that share.
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    lam: np.ndarray
    u: np.ndarray


SENSING_CODE = "dms_core.assembly.readings.sensing:compile_sensing_code"
"""Work for a second process, see side_by_side.py."""
COMPOSITION, PARTIALS, SENSING = fields(Composition), fields(Partials), fields(Sensing)


def composition(layout: Layout) -> Composition:
    """Indices of the constraints and elements that the layout's sensors are composed from."""
    constraints = {c.element.name: k for k, c in enumerate(layout.constraints)}
    kinds = [sensor.composition for sensor in layout.system.sensors]
    which = [constraints.get(c.placement.constraint, -1) for c in layout.sensors]
    lists = [
        [k for k, d in enumerate(layout.dynamics) if d.element.name in c.placement.sources] for c in layout.sensors
    ]
    ptr = np.concatenate([[0], np.cumsum([len(x) for x in lists])]).astype(np.int64)
    sources = np.array([k for x in lists for k in x], np.int64)
    return Composition(np.array(kinds, np.int64), np.array(which, np.int64), sources, ptr)


def new_sensing(dynamics: Packed, constraints: Packed, sensors: Packed, composed: Packed, work: Packed) -> Packed:
    """A packed Sensing of packed tables: three of Calls, a Composition and a Work."""
    side_by_side.wait_for(SENSING_CODE)
    return Packed(Sensing(dynamics, constraints, sensors, composed, work, _evaluation()))


def compile_sensing_code() -> None:
    """Compile what reads all sensors, the same for every model."""
    _evaluation()


@cache
def _evaluation() -> np.ndarray:
    """Address of `_evaluate_all`, compiled or loaded from disk here."""
    return np.array([address(_evaluate_all, TABLE_CALL)], np.int64)


@compiled(makes_arrays=True)
def _sources(composed, e):
    """Dynamic calls that sensor e sums."""
    ptr = ints(composed, COMPOSITION.source_ptr)
    return ints(composed, COMPOSITION.source)[ptr[e] : ptr[e + 1]]


@compiled
def _multipliers(constraints, c):
    """First and last row of constraint call c; an empty range for -1."""
    rows = ints(constraints, CALLS.row)
    return (rows[c], rows[c + 1]) if c >= 0 else (0, 0)


@compiled
def _evaluate_all(sensing):
    """All sensors at the state in the table's w, into w.y."""
    dynamics, constraints = inner(sensing, SENSING.dynamics), inner(sensing, SENSING.constraints)
    sensors, composed, w = (
        inner(sensing, SENSING.sensors),
        inner(sensing, SENSING.composed),
        inner(sensing, SENSING.work),
    )
    kinds, which, rows = (
        ints(composed, COMPOSITION.kind),
        ints(composed, COMPOSITION.constraint),
        ints(sensors, CALLS.row),
    )
    y, y_l, x = floats(w, WORK.y), floats(w, WORK.y_l), views(sensors, w)
    for e in range(kinds.shape[0]):
        if kinds[e] == COMPOSITIONS.none:
            first, end = _multipliers(constraints, which[e])
            evaluate_sensor(x, sensors, e, first, end, w, 0)
        elif kinds[e] == COMPOSITIONS.reaction:
            reaction(constraints, sensors, e, w, which[e])
        elif kinds[e] == COMPOSITIONS.force_load:
            force_load(dynamics, sensors, e, w, _sources(composed, e))
        else:
            joint_moment(dynamics, sensors, e, w, _sources(composed, e))
        for i in range(rows[e + 1] - rows[e]):
            y[rows[e] + i] = y_l[i]


@compiled
def evaluate_sensors(sensing):
    """All sensors at the state in the table's w, into w.y; called by address, as every loop that measures needs it."""
    call_with_table(ints(sensing, SENSING.evaluation)[0], sensing)


@compiled
def evaluate_partials(dynamics, constraints, sensors, composed, w, into):
    """Derivatives of all sensors at the state in w; `into`, a packed Partials, must be zero."""
    kinds, rows, which = (
        ints(composed, COMPOSITION.kind),
        ints(sensors, CALLS.row),
        ints(composed, COMPOSITION.constraint),
    )
    by_q, by_v, by_a = matrix(into, PARTIALS.q), matrix(into, PARTIALS.v), matrix(into, PARTIALS.a)
    by_lam, by_u = matrix(into, PARTIALS.lam), matrix(into, PARTIALS.u)
    Yq, Yv, Ya = matrix(w, WORK.Yq), matrix(w, WORK.Yv), matrix(w, WORK.Ya)
    Yl, Yu, x = matrix(w, WORK.Yl), matrix(w, WORK.Yu), views(sensors, w)
    iq, ptr, iu, u_ptr = (
        indices(sensors, CALLS.iq), ints(sensors, CALLS.iq_ptr), indices(sensors, CALLS.iu),
        ints(sensors, CALLS.iu_ptr),
    )  # fmt: skip
    for e in range(kinds.shape[0]):
        if kinds[e] != COMPOSITIONS.none:
            if kinds[e] == COMPOSITIONS.reaction:
                reaction_partials(constraints, sensors, e, w, which[e], by_q, by_lam)
            elif kinds[e] == COMPOSITIONS.force_load:
                force_load_partials(dynamics, sensors, e, w, _sources(composed, e), by_q, by_v, by_a)
            else:
                joint_moment_partials(dynamics, sensors, e, w, _sources(composed, e), by_q, by_v, by_a)
            continue
        first, end = _multipliers(constraints, which[e])
        n = evaluate_sensor(x, sensors, e, first, end, w, 1)
        for i in range(rows[e + 1] - rows[e]):
            row = rows[e] + i
            for j in range(n):
                by_q[row, iq[ptr[e] + j]] += Yq[i, j]
                by_v[row, iq[ptr[e] + j]] += Yv[i, j]
                by_a[row, iq[ptr[e] + j]] += Ya[i, j]
            for j in range(end - first):
                by_lam[row, first + j] += Yl[i, j]
            for j in range(u_ptr[e + 1] - u_ptr[e]):
                by_u[row, iu[u_ptr[e] + j]] += Yu[i, j]


@compiled
def put_state(w, signals, t, q, v, a, lam, behind):
    """A state and its inputs into w; `behind` takes the inputs behind a jump at t."""
    q_w, v_w, a_w, lam_w = floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.a), floats(w, WORK.lam)
    for i in range(q.shape[0]):
        q_w[i], v_w[i], a_w[i] = q[i], v[i], a[i]
    for i in range(lam.shape[0]):
        lam_w[i] = lam[i]
    evaluate_inputs(signals, t, not behind, w)


@compiled
def read_sensors(sensing, signals, t, q, v, a, lam, behind, y):
    """y at one state, all vectors; `behind` takes the inputs behind a jump at t."""
    w = inner(sensing, SENSING.work)
    put_state(w, signals, t, q, v, a, lam, behind)
    y_w = floats(w, WORK.y)
    evaluate_sensors(sensing)
    for i in range(y.shape[0]):
        y[i] = y_w[i]


@compiled
def measure(sensing, signals, t, q, v, a, lam, behind, y):
    """y[k] at the states q[k], v[k], a[k], lam[k] and times t[k]; behind[k] takes the inputs behind a jump at t[k]."""
    for k in range(t.shape[0]):
        read_sensors(sensing, signals, t[k], q[k], v[k], a[k], lam[k], behind[k], y[k])

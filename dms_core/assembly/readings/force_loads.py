"""Loads of force elements on a body, from the rows of their kernels; derivatives follow from the kernels' own."""

from dms_core.assembly.local import evaluate_dynamic, views
from dms_core.assembly.readings.composed_sensors import axis_of, frame_partials, ground_moment, moment_of
from dms_core.assembly.tables import CALLS, WORK
from dms_core.compiled.arena import floats, indices, ints, matrix
from dms_core.compiled.entries import integers_of, numbers_of
from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import (
    bilinear,
    cross,
    dot,
    euler_parameters,
    rotated,
    scale,
    sub,
    vec,
)


@compiled
def _gather(sensors, e, w):
    """The sensor's own bodies into q_l, the loaded one, then that of the frame; gives how many coordinates."""
    q, q_l, ptr, iq = (
        floats(w, WORK.q), floats(w, WORK.q_l), ints(sensors, CALLS.iq_ptr), indices(sensors, CALLS.iq),
    )  # fmt: skip
    n = ptr[e + 1] - ptr[e]
    for i in range(n):
        q_l[i] = q[iq[ptr[e] + i]]
    return n


@compiled
def _summed(dynamics, sensors, e, w, sources):
    """(F, moment about the centre of mass) of the sources on the loaded body, in ground axes."""
    x, body = views(dynamics, w), indices(sensors, CALLS.iq)[ints(sensors, CALLS.iq_ptr)[e]]
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for s in sources:
        n = evaluate_dynamic(x, dynamics, s, w, 0)
        for o in range(0, n - 6, 7):
            if x.iq[x.iq_ptr[s] + o] == body:
                force = sub(force, vec(x.r_l, o))
                moment = sub(moment, ground_moment(x.q_l, o, x.r_l, o + 3))
    return force, moment


@compiled
def force_load(dynamics, sensors, e, w, sources):
    """Sensor e, load of the dynamic calls in `sources`: values into y_l."""
    force, moment = _summed(dynamics, sensors, e, w, sources)
    _gather(sensors, e, w)
    q_l, y_l = floats(w, WORK.q_l), floats(w, WORK.y_l)
    moment = sub(moment, cross(rotated(q_l, 0, vec(numbers_of(sensors, e), 0)), force))
    for i in range(3):
        axis = axis_of(q_l, integers_of(sensors, e)[0], i)
        y_l[i], y_l[3 + i] = dot(axis, force), dot(axis, moment)


@compiled
def _put_column(J, j, o, q, arm, row, column, into):
    """into[row : row + 6, column] += load of the generalised force -J[o : o + 7, j], in ground axes."""
    force = (-J[o, j], -J[o + 1, j], -J[o + 2, j])
    moment = moment_of(euler_parameters(q, o), -J[o + 3, j], (-J[o + 4, j], -J[o + 5, j], -J[o + 6, j]))
    moment = sub(moment, cross(arm, force))
    for i in range(3):
        into[row + i, column] += force[i]
        into[row + 3 + i, column] += moment[i]


@compiled
def _put_own_partials(r, o, columns, q, s, row, by_q):
    """What the Euler parameters of the loaded body change of E(p) and of the arm A s."""
    p, force = euler_parameters(q, o), scale(-1.0, vec(r, o))
    for k in range(4):
        d = (1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2), 1.0 * (k == 3))
        moment = scale(-1.0, moment_of(d, r[o + 3], vec(r, o + 4)))
        moment = sub(moment, cross(scale(2.0, bilinear(p, d, s)), force))
        for i in range(3):
            by_q[row + 3 + i, columns[o + 3 + k]] += moment[i]


@compiled
def _turn_rows(q, frame, row, by):
    """Rows of a load in ground axes, turned into those of the frame."""
    x, y, z = axis_of(q, frame, 0), axis_of(q, frame, 1), axis_of(q, frame, 2)
    for j in range(by.shape[1]):
        for k in (row, row + 3):
            d = (by[k, j], by[k + 1, j], by[k + 2, j])
            by[k, j], by[k + 1, j], by[k + 2, j] = dot(x, d), dot(y, d), dot(z, d)


@compiled
def force_load_partials(dynamics, sensors, e, w, sources, by_q, by_v, by_a):
    """Derivatives of the load by q, v and vdot, into rows of the dense partials that are zero."""
    x, row, s = views(dynamics, w), ints(sensors, CALLS.row)[e], vec(numbers_of(sensors, e), 0)
    iq, first = indices(sensors, CALLS.iq), ints(sensors, CALLS.iq_ptr)[e]
    Jq, Jv, Ja, frame = matrix(w, WORK.Jq), matrix(w, WORK.Jv), matrix(w, WORK.Ja), integers_of(sensors, e)[0]
    for call in sources:
        n = evaluate_dynamic(x, dynamics, call, w, 1)
        columns = x.iq[x.iq_ptr[call] : x.iq_ptr[call] + n]
        for o in range(0, n - 6, 7):
            if columns[o] != iq[first]:
                continue
            arm = rotated(x.q_l, o, s)
            for j in range(n):
                _put_column(Jq, j, o, x.q_l, arm, row, columns[j], by_q)
                _put_column(Jv, j, o, x.q_l, arm, row, columns[j], by_v)
                _put_column(Ja, j, o, x.q_l, arm, row, columns[j], by_a)
            _put_own_partials(x.r_l, o, columns, x.q_l, s, row, by_q)
    if frame >= 0:
        force, moment = _summed(dynamics, sensors, e, w, sources)
        n = _gather(sensors, e, w)
        moment = sub(moment, cross(rotated(x.q_l, 0, s), force))
        for by in (by_q, by_v, by_a):
            _turn_rows(x.q_l, frame, row, by)
        frame_partials(w, n, frame, row, force, moment, iq[first : first + n], by_q)

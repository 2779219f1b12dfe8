"""Sensors composed from the kernels of other elements: the reaction of a constraint, the moment of a group of forces.

Their derivatives follow from those kernels' own.
"""

from dms_core.assembly.local import evaluate_constraint, evaluate_dynamic, views
from dms_core.assembly.tables import CALLS, WORK
from dms_core.compiled.arena import floats, indices, ints, matrix
from dms_core.compiled.entries import integers_of, numbers_of
from dms_core.compiled.jit import compiled
from dms_core.model.element import MOMENT
from dms_core.model.geometry.rotations import (
    add,
    add_gradient,
    bilinear,
    cross,
    dot,
    euler_parameters,
    point,
    rotated,
    scale,
    sub,
    vec,
)


@compiled
def moment_of(p, Q0, Q):
    """E(p) (Q0, Q) / 2: the moment in ground axes of a generalised load on Euler parameters p."""
    e = (p[1], p[2], p[3])
    return scale(0.5, add(add(scale(-Q0, e), scale(p[0], Q)), cross(e, Q)))


@compiled
def ground_moment(x, o, Q, k):
    """E(p) Q_p / 2 for the Euler parameters in x[o + 3 : o + 7] and Q_p = Q[k : k + 4]."""
    return moment_of(euler_parameters(x, o), Q[k], vec(Q, k + 1))


@compiled
def axis_of(q, frame, i):
    """Axis i of the body at offset `frame` in ground axes, or that of the ground itself for -1."""
    unit = (1.0 * (i == 0), 1.0 * (i == 1), 1.0 * (i == 2))
    return rotated(q, frame, unit) if frame >= 0 else unit


@compiled
def _constraint_load(calls, e, w, o):
    """Q = -(phi_q^T lam) on the body at local offset o, into r_l[0:7]."""
    r_l, G, lam_l, rows = floats(w, WORK.r_l), matrix(w, WORK.G), floats(w, WORK.lam_l), ints(calls, CALLS.row)
    for i in range(7):
        r_l[i] = 0.0
        for k in range(rows[e + 1] - rows[e]):
            r_l[i] -= G[k, o + i] * lam_l[k]


@compiled
def reaction(constraints, sensors, e, w, c):
    """Sensor e, reaction of constraint call c: values into y_l."""
    evaluate_constraint(views(constraints, w), constraints, c, w, 0)
    ip, y_l, q_l, r_l = integers_of(sensors, e), floats(w, WORK.y_l), floats(w, WORK.q_l), floats(w, WORK.r_l)
    o, frame = ip[0], ip[1]
    _constraint_load(constraints, c, w, o)
    force = vec(r_l, 0)
    arm = rotated(q_l, o, vec(numbers_of(sensors, e), 0))
    moment = sub(ground_moment(q_l, o, r_l, 3), cross(arm, force))
    for i in range(3):
        axis = axis_of(q_l, frame, i)
        y_l[i], y_l[3 + i] = dot(axis, force), dot(axis, moment)


@compiled
def _turn_partials(q, frame, row, column, force, moment, into):
    """into[row : row + 6, column] += the derivative (force, moment) given in ground axes, turned into the frame."""
    for i in range(3):
        axis = axis_of(q, frame, i)
        into[row + i, column] += dot(axis, force)
        into[row + 3 + i, column] += dot(axis, moment)


@compiled
def reaction_partials(constraints, sensors, e, w, c, by_q, by_lam):
    """Derivatives of the reaction by q and lam, scattered into the dense partials."""
    n = evaluate_constraint(views(constraints, w), constraints, c, w, 1)
    ip, row = integers_of(sensors, e), ints(sensors, CALLS.row)[e]
    o, frame, s = ip[0], ip[1], vec(numbers_of(sensors, e), 0)
    q, r, G, H = floats(w, WORK.q_l), floats(w, WORK.r_l), matrix(w, WORK.G), matrix(w, WORK.H)
    change, load = floats(w, WORK.v_l), floats(w, WORK.a_l)
    _constraint_load(constraints, c, w, o)
    force, arm, p = vec(r, 0), rotated(q, o, s), euler_parameters(q, o)
    iq, first = indices(constraints, CALLS.iq), ints(constraints, CALLS.iq_ptr)[c]
    for j in range(n):
        # By local coordinate j: Q changes by -H[:, j]; E(p) and A s of the body change if j is one of its parameters.
        for i in range(7):
            load[i] = -H[o + i, j]
            change[i] = 1.0 * (o + i == j)
        d_force, d_arm = vec(load, 0), scale(2.0, bilinear(p, euler_parameters(change, 0), s))
        d_moment = add(ground_moment(q, o, load, 3), ground_moment(change, 0, r, 3))
        d_moment = sub(d_moment, add(cross(arm, d_force), cross(d_arm, force)))
        _turn_partials(q, frame, row, iq[first + j], d_force, d_moment, by_q)
    rows = ints(constraints, CALLS.row)
    for k in range(rows[c + 1] - rows[c]):
        for i in range(7):
            load[i] = -G[k, o + i]
        d_force = vec(load, 0)
        _turn_partials(
            q, frame, row, rows[c] + k, d_force, sub(ground_moment(q, o, load, 3), cross(arm, d_force)), by_lam
        )
    if frame >= 0:
        moment = sub(ground_moment(q, o, r, 3), cross(arm, force))
        frame_partials(w, n, frame, row, force, moment, iq[first : first + n], by_q)


@compiled
def frame_partials(w, n, frame, row, force, moment, columns, by_q):
    """Add what the turning of the frame itself contributes."""
    Yq, q = matrix(w, WORK.G), floats(w, WORK.q_l)
    for i in range(3):
        unit = (1.0 * (i == 0), 1.0 * (i == 1), 1.0 * (i == 2))
        for vector, k in ((force, row + i), (moment, row + 3 + i)):
            for j in range(n):
                Yq[0, j] = 0.0
            add_gradient(Yq, 0, frame, q, vector, unit, 1.0)
            for j in range(n):
                by_q[k, columns[j]] += Yq[0, j]


@compiled
def _is_distal(sensors, e, body):
    """True if the body that starts at global coordinate `body` is one of sensor e's distal bodies."""
    iq, ptr = indices(sensors, CALLS.iq), ints(sensors, CALLS.iq_ptr)
    for k in range(ptr[e] + 7, ptr[e + 1], 7):
        if iq[k] == body:
            return True
    return False


@compiled
def _joint(sensors, e, w):
    """(axis, centre) of sensor e's joint in ground axes; leaves the proximal body in q_l[0:7]."""
    q, q_l, par = floats(w, WORK.q), floats(w, WORK.q_l), numbers_of(sensors, e)
    iq, start = indices(sensors, CALLS.iq), ints(sensors, CALLS.iq_ptr)[e]
    for i in range(7):
        q_l[i] = q[iq[start + i]]
    return rotated(q_l, 0, vec(par, MOMENT.axis)), point(q_l, 0, vec(par, MOMENT.centre))


@compiled
def joint_moment(dynamics, sensors, e, w, sources):
    """Sensor e, moment of the dynamic calls in `sources`: value into y_l[0]."""
    axis, centre = _joint(sensors, e, w)
    x, total = views(dynamics, w), 0.0
    for s in sources:
        n = evaluate_dynamic(x, dynamics, s, w, 0)
        for o in range(0, n - 6, 7):
            if _is_distal(sensors, e, x.iq[x.iq_ptr[s] + o]):
                lever = sub(vec(x.q_l, o), centre)
                total -= dot(axis, add(cross(lever, vec(x.r_l, o)), ground_moment(x.q_l, o, x.r_l, o + 3)))
    floats(w, WORK.y_l)[0] = total


@compiled
def _moment_of_column(J, j, o, q, lever, axis):
    """Moment about the axis of the generalised load J[o : o + 7, j] on the body at offset o."""
    force = (J[o, j], J[o + 1, j], J[o + 2, j])
    moment = moment_of(euler_parameters(q, o), J[o + 3, j], (J[o + 4, j], J[o + 5, j], J[o + 6, j]))
    return dot(axis, add(cross(lever, force), moment))


@compiled
def _own_partials(w, o, columns, axis, force, row, by_q):
    """Add the derivatives by the position and the Euler parameters of the loaded body itself."""
    r, about = floats(w, WORK.r_l), cross(force, axis)
    for i in range(3):
        by_q[row, columns[o + i]] += about[i]
    for i in range(4):
        d = (1.0 * (i == 0), 1.0 * (i == 1), 1.0 * (i == 2), 1.0 * (i == 3))
        by_q[row, columns[o + 3 + i]] -= dot(axis, moment_of(d, r[o + 3], vec(r, o + 4)))


@compiled
def joint_moment_partials(dynamics, sensors, e, w, sources, by_q, by_v, by_a):
    """Derivatives of the moment by q, v and vdot, scattered into the dense partials."""
    row, par = ints(sensors, CALLS.row)[e], numbers_of(sensors, e)
    axis, centre = _joint(sensors, e, w)
    x, Jq, Jv, Ja = views(dynamics, w), matrix(w, WORK.Jq), matrix(w, WORK.Jv), matrix(w, WORK.Ja)
    pull, turn = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for s in sources:
        n = evaluate_dynamic(x, dynamics, s, w, 1)
        columns = x.iq[x.iq_ptr[s] : x.iq_ptr[s] + n]
        for o in range(0, n - 6, 7):
            if not _is_distal(sensors, e, columns[o]):
                continue
            lever, force = sub(vec(x.q_l, o), centre), scale(-1.0, vec(x.r_l, o))
            pull = add(pull, force)
            turn = add(turn, sub(cross(lever, force), ground_moment(x.q_l, o, x.r_l, o + 3)))
            _own_partials(w, o, columns, axis, force, row, by_q)
            for j in range(n):
                by_q[row, columns[j]] -= _moment_of_column(Jq, j, o, x.q_l, lever, axis)
                by_v[row, columns[j]] -= _moment_of_column(Jv, j, o, x.q_l, lever, axis)
                by_a[row, columns[j]] -= _moment_of_column(Ja, j, o, x.q_l, lever, axis)
    _joint(sensors, e, w)
    about, Yq = cross(pull, axis), matrix(w, WORK.G)
    for j in range(7):
        Yq[0, j] = -about[j] if j < 3 else 0.0
    add_gradient(Yq, 0, 0, x.q_l, turn, vec(par, MOMENT.axis), 1.0)
    add_gradient(Yq, 0, 0, x.q_l, about, vec(par, MOMENT.centre), -1.0)
    iq, start = indices(sensors, CALLS.iq), ints(sensors, CALLS.iq_ptr)[e]
    for j in range(7):
        by_q[row, iq[start + j]] += Yq[0, j]

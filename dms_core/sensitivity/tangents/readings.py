"""Sensors at one state by states, inputs and declared numbers, pulled back through the accelerations that belong to it.

A sensor y = h(q, v, vdot, lam, u) reads vdot, first-order rates and lam, which (r2, phi_a) = 0 give where q and v are
known, with phi_a = phi_q vdot + (phi_q v)_q v + phi_tt. With K the matrix of that problem and K^T psi = h by vdot (of
coordinates of second order), v (of first order) and lam,

    by q: h_q - r2_q^T psi_2 - ((phi_q vdot)_q + ((phi_q v)_q v)_q)^T psi_3
    by v: h_v - r2_v^T psi_2 - 2 (phi_q v)_q^T psi_3
    by u: h_u - r2_u^T psi_2          by p: h_p - r2_p^T psi_2 - phi_a_p^T psi_3

q and v are those of all coordinates: their tangents lie in those of the constraints already. As these are gradients,
((phi_q v)_q v)_q^T psi is the derivative of (phi_q v)_q^T psi along v, which is differenced.
"""

import math

from dms_core.assembly.derivatives.input_derivatives import STEP, dynamic_by_input
from dms_core.assembly.local import evaluate_constraint, evaluate_dynamic, put_acceleration_rows, views
from dms_core.assembly.readings.sensing import PARTIALS, SENSING, evaluate_partials, evaluate_sensors
from dms_core.assembly.residual import evaluate_residual
from dms_core.assembly.tables import CALLS, MODEL, WORK
from dms_core.compiled.arena import flags, floats, inner, ints, matrix, naturals, table_at
from dms_core.compiled.entries import SLOPES
from dms_core.compiled.jit import compiled
from dms_core.sensitivity.tangents.reading_tables import READING, READINGS, Reading
from dms_core.sensitivity.tangents.tables import ADJOINTS, DIFFERENTIALS, MOVEMENT, Movement
from dms_core.simulation.iteration.linear_solve import back_substitute_transposed
from dms_core.simulation.state import STATE

MOVEMENT_FIELDS, READING_FIELDS = len(Movement._fields), len(Reading._fields)
ALONG = 10.0 * STEP
"""Largest change of a coordinate in the difference along v."""


@compiled
def _partials(m, r, w):
    """Derivatives of the sensors by what they read."""
    into, sensing = inner(r, READINGS.partials), inner(r, READINGS.sensing)
    for block in (PARTIALS.q, PARTIALS.v, PARTIALS.a, PARTIALS.lam, PARTIALS.u):
        matrix(into, block)[:, :] = 0.0
    evaluate_partials(
        inner(m, MODEL.dynamics), inner(m, MODEL.constraints), inner(sensing, SENSING.sensors),
        inner(sensing, SENSING.composed), w, into,
    )  # fmt: skip


@compiled
def _solve(m, s, r):
    """psi of each sensor; True where any is not 0."""
    partials, free, active = inner(r, READINGS.partials), naturals(m, MODEL.free), naturals(m, MODEL.active)
    by_v, by_a, by_lam = matrix(partials, PARTIALS.v), matrix(partials, PARTIALS.a), matrix(partials, PARTIALS.lam)
    psi_2, psi_3, second = matrix(r, READINGS.psi_2), matrix(r, READINGS.psi_3), flags(m, MODEL.second)
    b, x, n, any_reads = floats(s, STATE.rate_b), floats(s, STATE.rate_x), free.shape[0], False
    asked = ints(r, READINGS.asked)
    psi_2[:, :] = 0.0
    psi_3[:, :] = 0.0
    for k in range(psi_2.shape[0]):
        reads = False
        for j in range(n):
            c = free[j]
            b[j] = by_a[asked[k], c] if second[c] else by_v[asked[k], c]
            reads = reads or b[j] != 0.0
        for j in range(active.shape[0]):
            b[n + j] = by_lam[asked[k], active[j]]
            reads = reads or b[n + j] != 0.0
        if not reads:
            continue
        any_reads = True
        back_substitute_transposed(m, MODEL.rate_lu, floats(s, STATE.rate_values), b, x, floats(s, STATE.rate_work))
        for j in range(n):
            psi_2[k, free[j]] = x[j]
        for j in range(active.shape[0]):
            psi_3[k, active[j]] = x[n + j]
    return any_reads


@compiled
def _through_forces(m, w, r, b):
    """What r2 adds to the derivatives by q and v."""
    calls, aq, av, psi = (
        inner(m, MODEL.dynamics),
        matrix(b, ADJOINTS.aq),
        matrix(b, ADJOINTS.av),
        matrix(r, READINGS.psi_2),
    )
    psi, x, Jq, Jv = matrix(r, READINGS.psi_2), views(calls, w), matrix(w, WORK.Jq), matrix(w, WORK.Jv)
    n_q = aq.shape[1]
    for e in ints(calls, CALLS.moving):
        n, start = evaluate_dynamic(x, calls, e, w, 1), x.iq_ptr[e]
        for j in range(n):
            column = x.iq[start + j]
            if column >= n_q:
                continue
            for k in range(psi.shape[0]):
                for i in range(n):
                    aq[k, column] -= Jq[i, j] * psi[k, x.iq[start + i]]
                    av[k, column] -= Jv[i, j] * psi[k, x.iq[start + i]]


@compiled
def _through_rows(m, w, r, b, factor_q, factor_v, with_lam):
    """aq and av less their factors times (phi_q v)_q^T psi_3 at the q, v in w; aq less (phi_q^T lam)_q psi_2 too."""
    calls, aq, av = inner(m, MODEL.constraints), matrix(b, ADJOINTS.aq), matrix(b, ADJOINTS.av)
    psi_2, psi_3, x, H = matrix(r, READINGS.psi_2), matrix(r, READINGS.psi_3), views(calls, w), matrix(w, WORK.H)
    n_q = aq.shape[1]
    for e in ints(calls, CALLS.moving):
        n, start, row = evaluate_constraint(x, calls, e, w, 1), x.iq_ptr[e], x.row[e]
        for j in range(n):
            column = x.iq[start + j]
            if column >= n_q:
                continue
            for k in range(psi_3.shape[0]):
                total = 0.0
                for i in range(x.row[e + 1] - row):
                    total += x.W[i, j] * psi_3[k, row + i]
                aq[k, column] -= factor_q * total
                av[k, column] -= factor_v * total
                if with_lam:
                    for i in range(n):
                        aq[k, column] -= H[i, j] * psi_2[k, x.iq[start + i]]


@compiled
def _through_accelerations(m, s, w, r, b):
    """What (r2, phi_a) add to the derivatives by q and v; w is left as it was."""
    q, v, a, second = floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.a), flags(m, MODEL.second)
    q_n, v_n, largest = floats(s, STATE.q), floats(s, STATE.v), 1.0
    _through_forces(m, w, r, b)
    _through_rows(m, w, r, b, 0.0, 2.0, True)
    for i in range(q_n.shape[0]):
        largest = max(largest, abs(v_n[i]) if second[i] else 0.0)
        v[i] = a[i]
    _through_rows(m, w, r, b, 1.0, 0.0, False)
    h = ALONG / largest
    for i in range(q_n.shape[0]):
        v[i] = v_n[i]
    for sign in (1.0, -1.0):
        for i in range(q_n.shape[0]):
            q[i] = q_n[i] + (sign * h * v_n[i] if second[i] else 0.0)
        _through_rows(m, w, r, b, 0.5 * sign / h, 0.0, False)
    for i in range(q_n.shape[0]):
        q[i] = q_n[i]


@compiled
def _by_inputs(m, w, d, r, b):
    """Derivatives by the values of inputs."""
    calls, psi, au = inner(m, MODEL.dynamics), matrix(r, READINGS.psi_2), matrix(b, ADJOINTS.au)
    by_u, slopes = matrix(inner(r, READINGS.partials), PARTIALS.u), inner(d, DIFFERENTIALS.slopes)
    x, kernels, Ju = views(calls, w), ints(d, DIFFERENTIALS.kernels), matrix(slopes, SLOPES.Ju)
    asked = ints(r, READINGS.asked)
    for k in range(au.shape[0]):
        for i in range(by_u.shape[1]):
            au[k, 3 * i] += by_u[asked[k], i]
    for e in ints(d, DIFFERENTIALS.reading):
        dynamic_by_input(calls, kernels, e, w, slopes)
        start, first = x.iq_ptr[e], x.iu_ptr[e]
        for u in range(x.iu_ptr[e + 1] - first):
            for k in range(psi.shape[0]):
                for i in range(x.iq_ptr[e + 1] - start):
                    au[k, 3 * x.iu[first + u]] -= Ju[i, 3 * u] * psi[k, x.iq[start + i]]


@compiled
def _add_rows(calls, w, r, ap, j, factor):
    """Add factor times (psi_2, psi_3) times (r2, phi_a), as evaluated, to the derivatives by number j."""
    psi_2, psi_3, r2, x = matrix(r, READINGS.psi_2), matrix(r, READINGS.psi_3), floats(w, WORK.r2), views(calls, w)
    for k in range(psi_2.shape[0]):
        for i in range(psi_2.shape[1]):
            ap[k, j] -= factor * r2[i] * psi_2[k, i]
    for e in ints(calls, CALLS.moving):
        put_acceleration_rows(x, e, evaluate_constraint(x, calls, e, w, 1))
        for k in range(psi_3.shape[0]):
            for row in range(x.row[e], x.row[e + 1]):
                ap[k, j] -= factor * x.phi_a[row] * psi_3[k, row]


@compiled
def _by_numbers(s, w, d, r, b, reads_rates):
    """Derivatives by the declared numbers: central differences of what each of them moves."""
    movements, moved, ap = ints(d, DIFFERENTIALS.movements), ints(r, READINGS.moved), matrix(b, ADJOINTS.ap)
    y, asked = floats(w, WORK.y), ints(r, READINGS.asked)
    for j in range(movements.shape[0]):
        move, reading = table_at(movements[j], MOVEMENT_FIELDS), table_at(moved[j], READING_FIELDS)
        half = 0.5 / floats(move, MOVEMENT.step)[0]
        for side in range(2):
            factor = half if side == 0 else -half
            evaluate_sensors(inner(reading, READING.high if side == 0 else READING.low))
            for k in range(ap.shape[0]):
                ap[k, j] += factor * y[asked[k]]
            if reads_rates:
                constraints = inner(move, MOVEMENT.high_constraints if side == 0 else MOVEMENT.low_constraints)
                dynamics = inner(move, MOVEMENT.high_dynamics if side == 0 else MOVEMENT.low_dynamics)
                evaluate_residual(dynamics, constraints, w)
                _add_rows(constraints, w, r, ap, j, factor)


@compiled
def _clear(r):
    """All derivatives 0."""
    b = inner(r, READINGS.found)
    for block in (ADJOINTS.aq, ADJOINTS.av, ADJOINTS.au, ADJOINTS.ap):
        matrix(b, block)[:, :] = 0.0


@compiled
def pull_back(m, s, d, r):
    """Values of the sensors of r and their derivatives, a row each; False where one is not finite.

    The state has the accelerations, first-order rates and multipliers that belong to it, and rate_values the factors of
    their problem: as `consistent_rates` leaves it.
    """
    w, second, b = inner(s, STATE.w), flags(m, MODEL.second), inner(r, READINGS.found)
    partials, values, y = inner(r, READINGS.partials), floats(w, WORK.y), floats(r, READINGS.y)
    aq, av, by_q, by_v = (
        matrix(b, ADJOINTS.aq), matrix(b, ADJOINTS.av), matrix(partials, PARTIALS.q), matrix(partials, PARTIALS.v),
    )  # fmt: skip
    asked = ints(r, READINGS.asked)
    _clear(r)
    evaluate_sensors(inner(r, READINGS.sensing))
    for k in range(y.shape[0]):
        y[k] = values[asked[k]]
    _partials(m, r, w)
    reads_rates = _solve(m, s, r)
    if reads_rates:
        _through_accelerations(m, s, w, r, b)
    _by_inputs(m, w, d, r, b)
    _by_numbers(s, w, d, r, b, reads_rates)
    total = 0.0
    for k in range(aq.shape[0]):
        for i in range(aq.shape[1]):
            aq[k, i] += by_q[asked[k], i]
            # Rates of first-order states follow from the states: they are none.
            av[k, i] = av[k, i] + by_v[asked[k], i] if second[i] else 0.0
            total += abs(aq[k, i]) + abs(av[k, i])
    return total < math.inf


@compiled
def _add(into, found, sums, share):
    """into[i] += share times the sum of sums[i, k] found[k]."""
    for i in range(sums.shape[0]):
        for k in range(sums.shape[1]):
            weight = share * sums[i, k]
            if weight != 0.0:
                for j in range(into.shape[1]):
                    into[i, j] += weight * found[k, j]


@compiled
def add_readings(r, b, sums, share):
    """Add `share` times sums of the sensors, shape (outputs, k), to the adjoints of as many outputs."""
    found = inner(r, READINGS.found)
    for block in (ADJOINTS.aq, ADJOINTS.av, ADJOINTS.au, ADJOINTS.ap):
        _add(matrix(b, block), matrix(found, block), sums, share)

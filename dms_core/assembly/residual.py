"""The one loop over all elements: local coordinates in, residual and derivatives out (paper eq. 2).

r1 = v - qdot - phi_q^T mu        r2 = M vdot + phi_q^T lam - f        r3 = phi        r4 = phi_q v + phi_t
"""

import math

from dms_core.assembly.arena import floats, indices, ints, matrix, naturals
from dms_core.assembly.calls import call_entry, call_signal
from dms_core.assembly.scatter import (
    begin_newton,
    scatter_constraint,
    scatter_constraint_rates,
    scatter_dynamic,
    scatter_dynamic_rates,
)
from dms_core.assembly.tables import CALLS, FUNCTION, HARMONIC, SIGNALS, WORK
from dms_core.jit import compiled


@compiled
def _piece(t, starts, first, end, before):
    """Index of the polynomial piece that holds at t; `before` takes the one on the left at its start."""
    low, high = first, end
    while high - low > 1:
        middle = (low + high) // 2
        if starts[middle] < t or (starts[middle] == t and not before):
            low = middle
        else:
            high = middle
    return low


@compiled
def evaluate_inputs(signals, t, before, w):
    """u[k] = value, first and second derivative of input k at t; `before` takes the limit from the left at a jump."""
    u, kind, ptr = matrix(w, WORK.u), ints(signals, SIGNALS.kind), ints(signals, SIGNALS.ptr)
    starts, c = floats(signals, SIGNALS.t), matrix(signals, SIGNALS.c)
    for k in range(kind.shape[0]):
        i = ptr[k]
        if kind[k] == HARMONIC:
            rate = c[i, 1]
            x = rate * t + c[i, 2]
            u[k, 0] = c[i, 0] * math.sin(x) + c[i, 3]
            u[k, 1] = c[i, 0] * rate * math.cos(x)
            u[k, 2] = -c[i, 0] * rate * rate * math.sin(x)
        elif kind[k] == FUNCTION:
            call_signal(ints(signals, SIGNALS.address)[k], t, u[k])
        else:
            i = _piece(t, starts, i, ptr[k + 1], before)
            s = t - starts[i]
            u[k, 0] = c[i, 0] + s * (c[i, 1] + s * (c[i, 2] + s * (c[i, 3] + s * (c[i, 4] + s * c[i, 5]))))
            u[k, 1] = c[i, 1] + s * (2.0 * c[i, 2] + s * (3.0 * c[i, 3] + s * (4.0 * c[i, 4] + s * 5.0 * c[i, 5])))
            u[k, 2] = 2.0 * c[i, 2] + s * (6.0 * c[i, 3] + s * (12.0 * c[i, 4] + s * 20.0 * c[i, 5]))


@compiled
def gather(calls, e, w):
    """Copy the local q, v and inputs of call e; gives the number of local coordinates."""
    iq, ptr = naturals(calls, CALLS.iq), ints(calls, CALLS.iq_ptr)
    q, v, q_l, v_l = floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.q_l), floats(w, WORK.v_l)
    start = ptr[e]
    n = ptr[e + 1] - start
    for i in range(n):
        k = iq[start + i]
        q_l[i], v_l[i] = q[k], v[k]
    ptr = ints(calls, CALLS.iu_ptr)
    if ptr[e + 1] > ptr[e]:
        iu, u, u_l = indices(calls, CALLS.iu), matrix(w, WORK.u), matrix(w, WORK.u_l)
        for i in range(ptr[e + 1] - ptr[e]):
            for j in range(3):
                u_l[i, j] = u[iu[ptr[e] + i], j]
    return n


@compiled
def gather_accelerations(calls, e, w):
    """Copy the local vdot of call e."""
    iq, ptr, a, a_l = naturals(calls, CALLS.iq), ints(calls, CALLS.iq_ptr), floats(w, WORK.a), floats(w, WORK.a_l)
    start = ptr[e]
    for i in range(ptr[e + 1] - start):
        a_l[i] = a[iq[start + i]]


@compiled
def _clear(block, m, n):
    """block[:m, :n] = 0."""
    for i in range(m):
        for j in range(n):
            block[i, j] = 0.0


@compiled
def evaluate_dynamic(calls, e, w, level):
    """Run the dynamic kernel of call e into r_l and, for level 1, Jq, Jv, Ja; gives n."""
    n = gather(calls, e, w)
    gather_accelerations(calls, e, w)
    r_l = floats(w, WORK.r_l)
    Jq, Jv, Ja = matrix(w, WORK.Jq), matrix(w, WORK.Jv), matrix(w, WORK.Ja)
    for i in range(n):
        r_l[i] = 0.0
    if level > 0:
        _clear(Jq, n, n)
        _clear(Jv, n, n)
        _clear(Ja, n, n)
    call_entry(ints(calls, CALLS.kernel)[e], calls, e, w, level)
    return n


@compiled
def evaluate_constraint(calls, e, w, level):
    """Run the constraint kernel of call e into phi_l, phi_t_l, G and, for level 1, W, H; gives n."""
    n = gather(calls, e, w)
    rows = ints(calls, CALLS.row)
    row = rows[e]
    m = rows[e + 1] - row
    phi_l, phi_t_l, lam_l = floats(w, WORK.phi_l), matrix(w, WORK.phi_t_l), floats(w, WORK.lam_l)
    lam = floats(w, WORK.lam)
    G, W, H = matrix(w, WORK.G), matrix(w, WORK.W), matrix(w, WORK.H)
    _clear(G, m, n)
    for k in range(m):
        lam_l[k] = lam[row + k]
        phi_l[k] = phi_t_l[k, 0] = phi_t_l[k, 1] = 0.0
    if level > 0:
        _clear(W, m, n)
        _clear(H, n, n)
    call_entry(ints(calls, CALLS.kernel)[e], calls, e, w, level)
    return n


@compiled
def add_constraint_values(calls, e, w, n):
    """Rows of phi and phi_q v + phi_t of call e, from its local arrays."""
    rows = ints(calls, CALLS.row)
    phi, phi_v, phi_l, phi_t_l = (
        floats(w, WORK.phi),
        floats(w, WORK.phi_v),
        floats(w, WORK.phi_l),
        matrix(w, WORK.phi_t_l),
    )
    G, v_l = matrix(w, WORK.G), floats(w, WORK.v_l)
    for k in range(rows[e + 1] - rows[e]):
        rate = phi_t_l[k, 0]
        for i in range(n):
            rate += G[k, i] * v_l[i]
        phi[rows[e] + k] = phi_l[k]
        phi_v[rows[e] + k] = rate


@compiled
def add_constraint_forces(calls, e, w, n):
    """phi_q^T lam into r2 and phi_q^T mu into gmu, of call e."""
    rows, iq, start = ints(calls, CALLS.row), naturals(calls, CALLS.iq), ints(calls, CALLS.iq_ptr)[e]
    lam, mu, r2, gmu, G = (
        floats(w, WORK.lam), floats(w, WORK.mu), floats(w, WORK.r2), floats(w, WORK.gmu), matrix(w, WORK.G),
    )  # fmt: skip
    first = rows[e]
    m = rows[e + 1] - first
    for i in range(n):
        x, y = 0.0, 0.0
        for k in range(m):
            x += G[k, i] * lam[first + k]
            y += G[k, i] * mu[first + k]
        r2[iq[start + i]] += x
        gmu[iq[start + i]] += y


@compiled
def evaluate_constraints(calls, w):
    """phi and phi_q v + phi_t of the rows that are solved for, without derivatives."""
    for e in ints(calls, CALLS.moving):
        n = evaluate_constraint(calls, e, w, 0)
        add_constraint_values(calls, e, w, n)


@compiled
def _add_dynamic_rows(calls, e, w, n):
    """r2 += r_l of call e."""
    r2, r_l = floats(w, WORK.r2), floats(w, WORK.r_l)
    iq, start = naturals(calls, CALLS.iq), ints(calls, CALLS.iq_ptr)[e]
    for i in range(n):
        r2[iq[start + i]] += r_l[i]


@compiled
def evaluate_residual(dynamics, constraints, w):
    """r2, gmu, phi and phi_v at the q, v, a, lam, mu, u in w, of the calls that count as moving; no derivatives."""
    floats(w, WORK.r2)[:] = 0.0
    floats(w, WORK.gmu)[:] = 0.0
    for e in ints(dynamics, CALLS.moving):
        n = evaluate_dynamic(dynamics, e, w, 0)
        _add_dynamic_rows(dynamics, e, w, n)
    for e in ints(constraints, CALLS.moving):
        n = evaluate_constraint(constraints, e, w, 0)
        add_constraint_values(constraints, e, w, n)
        add_constraint_forces(constraints, e, w, n)


@compiled
def _dynamic_derivatives(calls, e, w):
    """Values of dynamic call e into the residual, its derivatives into the local arrays."""
    n = evaluate_dynamic(calls, e, w, 1)
    _add_dynamic_rows(calls, e, w, n)


@compiled
def _constraint_derivatives(calls, e, w):
    """Values and forces of constraint call e into the residual, its derivatives into the local arrays; gives n."""
    n = evaluate_constraint(calls, e, w, 1)
    add_constraint_values(calls, e, w, n)
    add_constraint_forces(calls, e, w, n)
    return n


@compiled
def evaluate_newton(dynamics, constraints, pattern, w, c0, values):
    """As evaluate_residual, and the scaled Newton matrix into `values` (see sparsity.newton_pattern)."""
    floats(w, WORK.r2)[:] = 0.0
    floats(w, WORK.gmu)[:] = 0.0
    begin_newton(pattern, values)
    for e in ints(dynamics, CALLS.moving):
        _dynamic_derivatives(dynamics, e, w)
        scatter_dynamic(pattern, e, w, 1.0 / c0, values)
    for e in ints(constraints, CALLS.moving):
        _constraint_derivatives(constraints, e, w)
        scatter_constraint(pattern, e, w, 1.0 / c0, values)


@compiled
def evaluate_rates(dynamics, constraints, pattern, w, values):
    """r2, phi_a and the matrix of the acceleration problem (see sparsity.rate_pattern)."""
    floats(w, WORK.r2)[:] = 0.0
    floats(w, WORK.gmu)[:] = 0.0
    values[:] = 0.0
    for e in ints(dynamics, CALLS.moving):
        _dynamic_derivatives(dynamics, e, w)
        scatter_dynamic_rates(pattern, e, w, values)
    for e in ints(constraints, CALLS.moving):
        n = _constraint_derivatives(constraints, e, w)
        gather_accelerations(constraints, e, w)
        _add_acceleration_rows(constraints, e, w, n)
        scatter_constraint_rates(pattern, e, w, values)


@compiled
def evaluate_both(dynamics, constraints, newton, rates, w, c0, newton_values, rate_values):
    """As evaluate_rates, and with the same derivatives the Newton matrix of a step that begins here."""
    floats(w, WORK.r2)[:] = 0.0
    floats(w, WORK.gmu)[:] = 0.0
    rate_values[:] = 0.0
    begin_newton(newton, newton_values)
    for e in ints(dynamics, CALLS.moving):
        _dynamic_derivatives(dynamics, e, w)
        scatter_dynamic_rates(rates, e, w, rate_values)
        scatter_dynamic(newton, e, w, 1.0 / c0, newton_values)
    for e in ints(constraints, CALLS.moving):
        n = _constraint_derivatives(constraints, e, w)
        gather_accelerations(constraints, e, w)
        _add_acceleration_rows(constraints, e, w, n)
        scatter_constraint_rates(rates, e, w, rate_values)
        scatter_constraint(newton, e, w, 1.0 / c0, newton_values)


@compiled
def _add_acceleration_rows(calls, e, w, n):
    """phi_a = phi_q vdot + (phi_q v)_q v + phi_tt of call e."""
    rows, phi_a, phi_t_l = ints(calls, CALLS.row), floats(w, WORK.phi_a), matrix(w, WORK.phi_t_l)
    G, W, v_l, a_l = matrix(w, WORK.G), matrix(w, WORK.W), floats(w, WORK.v_l), floats(w, WORK.a_l)
    for k in range(rows[e + 1] - rows[e]):
        x = phi_t_l[k, 1]
        for i in range(n):
            x += G[k, i] * a_l[i] + W[k, i] * v_l[i]
        phi_a[rows[e] + k] = x


@compiled
def dense_constraints(constraints, w, G, W):
    """phi, phi_v and dense phi_q, (phi_q v)_q, shapes (n_phi, n_q + 7)."""
    G[:, :] = 0.0
    W[:, :] = 0.0
    G_l, W_l, iq = matrix(w, WORK.G), matrix(w, WORK.W), indices(constraints, CALLS.iq)
    ptr, rows = ints(constraints, CALLS.iq_ptr), ints(constraints, CALLS.row)
    for e in range(ints(constraints, CALLS.kernel).shape[0]):
        n = evaluate_constraint(constraints, e, w, 1)
        add_constraint_values(constraints, e, w, n)
        for k in range(rows[e + 1] - rows[e]):
            for i in range(n):
                G[rows[e] + k, iq[ptr[e] + i]] += G_l[k, i]
                W[rows[e] + k, iq[ptr[e] + i]] += W_l[k, i]


@compiled
def dense_jacobians(constraints, w, q, G):
    """phi_q at each of the positions q, shapes (k, n_q) and (k, n_phi, n_q + 7)."""
    G[:, :, :] = 0.0
    G_l, q_w, iq = matrix(w, WORK.G), floats(w, WORK.q), indices(constraints, CALLS.iq)
    ptr, rows = ints(constraints, CALLS.iq_ptr), ints(constraints, CALLS.row)
    for k in range(q.shape[0]):
        for i in range(q.shape[1]):
            q_w[i] = q[k, i]
        for e in range(ints(constraints, CALLS.kernel).shape[0]):
            n = evaluate_constraint(constraints, e, w, 0)
            for m in range(rows[e + 1] - rows[e]):
                for i in range(n):
                    G[k, rows[e] + m, iq[ptr[e] + i]] += G_l[m, i]


@compiled
def evaluate_sensor(sensors, e, first, end, w, level):
    """Run the sensor kernel of call e into y_l and, for level 1, its derivatives; lam[first:end] is handed in."""
    n = gather(sensors, e, w)
    gather_accelerations(sensors, e, w)
    rows = ints(sensors, CALLS.row)
    m = rows[e + 1] - rows[e]
    y_l, lam, lam_l = floats(w, WORK.y_l), floats(w, WORK.lam), floats(w, WORK.lam_l)
    Yq, Yv, Ya = matrix(w, WORK.Yq), matrix(w, WORK.Yv), matrix(w, WORK.Ya)
    Yl, Yu = matrix(w, WORK.Yl), matrix(w, WORK.Yu)
    for k in range(end - first):
        lam_l[k] = lam[first + k]
    y_l[:m] = 0.0
    if level > 0:
        _clear(Yq, m, n)
        _clear(Yv, m, n)
        _clear(Ya, m, n)
        _clear(Yl, m, Yl.shape[1])
        _clear(Yu, m, Yu.shape[1])
    call_entry(ints(sensors, CALLS.kernel)[e], sensors, e, w, level)
    return n

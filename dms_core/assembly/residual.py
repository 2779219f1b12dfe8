"""The one loop over all elements: local coordinates in, residual and derivatives out (paper eq. 2).

r1 = v - qdot - phi_q^T mu        r2 = M vdot + phi_q^T lam - f        r3 = phi        r4 = phi_q v + phi_t
"""

import math

from dms_core.assembly.local import (
    add_solved_forces,
    add_solved_rows,
    evaluate_constraint,
    evaluate_dynamic,
    put_acceleration_rows,
    put_constraint_values,
    put_solved_values,
    views,
)
from dms_core.assembly.scatter import (
    begin_newton,
    scatter_constraint,
    scatter_constraint_rates,
    scatter_dynamic,
    scatter_dynamic_rates,
)
from dms_core.assembly.tables import CALLS, FUNCTION, HARMONIC, SIGNALS, WORK
from dms_core.compiled.arena import floats, ints, matrix
from dms_core.compiled.calls import call_signal
from dms_core.compiled.jit import compiled


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
def evaluate_constraints(calls, w):
    """phi and phi_q v + phi_t of the rows that are solved for, without derivatives."""
    x = views(calls, w)
    for e in ints(calls, CALLS.moving):
        n = evaluate_constraint(x, calls, e, w, 0)
        put_solved_values(x, e, n)


@compiled
def evaluate_residual(dynamics, constraints, w):
    """r2, gmu, phi and phi_v at the q, v, a, lam, mu, u in w, of what is solved for; no derivatives."""
    x = views(dynamics, w)
    x.r2[:] = 0.0
    x.gmu[:] = 0.0
    for e in ints(dynamics, CALLS.moving):
        n = evaluate_dynamic(x, dynamics, e, w, 0)
        add_solved_rows(x, e, n)
    y = views(constraints, w)
    for e in ints(constraints, CALLS.moving):
        n = evaluate_constraint(y, constraints, e, w, 0)
        put_solved_values(y, e, n)
        add_solved_forces(y, e, n)


@compiled(forceinline=True)
def _dynamic_derivatives(x, calls, e, w):
    """Values of dynamic call e into the residual, its derivatives into the local arrays."""
    n = evaluate_dynamic(x, calls, e, w, 1)
    add_solved_rows(x, e, n)


@compiled(forceinline=True)
def _constraint_derivatives(x, calls, e, w):
    """Values and forces of constraint call e into the residual, its derivatives into the local arrays; gives n."""
    n = evaluate_constraint(x, calls, e, w, 1)
    put_solved_values(x, e, n)
    add_solved_forces(x, e, n)
    return n


@compiled
def evaluate_newton(dynamics, constraints, pattern, w, c0, values):
    """As evaluate_residual, and the scaled Newton matrix into `values` (see sparsity.newton_pattern)."""
    x, y = views(dynamics, w), views(constraints, w)
    x.r2[:] = 0.0
    x.gmu[:] = 0.0
    begin_newton(pattern, values)
    for e in ints(dynamics, CALLS.moving):
        _dynamic_derivatives(x, dynamics, e, w)
        scatter_dynamic(pattern, e, w, 1.0 / c0, values)
    for e in ints(constraints, CALLS.moving):
        _constraint_derivatives(y, constraints, e, w)
        scatter_constraint(pattern, e, w, 1.0 / c0, values)


@compiled
def evaluate_newton_pair(dynamics, constraints, pattern, w, c0, values, complex_c0, complex_values):
    """As evaluate_newton, and with the same derivatives the matrix of a complex c0."""
    x, y = views(dynamics, w), views(constraints, w)
    x.r2[:] = 0.0
    x.gmu[:] = 0.0
    begin_newton(pattern, values)
    begin_newton(pattern, complex_values)
    for e in ints(dynamics, CALLS.moving):
        _dynamic_derivatives(x, dynamics, e, w)
        scatter_dynamic(pattern, e, w, 1.0 / c0, values)
        scatter_dynamic(pattern, e, w, 1.0 / complex_c0, complex_values)
    for e in ints(constraints, CALLS.moving):
        _constraint_derivatives(y, constraints, e, w)
        scatter_constraint(pattern, e, w, 1.0 / c0, values)
        scatter_constraint(pattern, e, w, 1.0 / complex_c0, complex_values)


@compiled
def evaluate_rates(dynamics, constraints, pattern, w, values):
    """r2, phi_a and the matrix of the acceleration problem (see sparsity.rate_pattern)."""
    x, y = views(dynamics, w), views(constraints, w)
    x.r2[:] = 0.0
    x.gmu[:] = 0.0
    values[:] = 0.0
    for e in ints(dynamics, CALLS.moving):
        _dynamic_derivatives(x, dynamics, e, w)
        scatter_dynamic_rates(pattern, e, w, values)
    for e in ints(constraints, CALLS.moving):
        n = _constraint_derivatives(y, constraints, e, w)
        put_acceleration_rows(y, e, n)
        scatter_constraint_rates(pattern, e, w, values)


@compiled
def evaluate_both(dynamics, constraints, newton, rates, w, c0, newton_values, rate_values):
    """As evaluate_rates, and with the same derivatives the Newton matrix of a step that begins here."""
    x, y = views(dynamics, w), views(constraints, w)
    x.r2[:] = 0.0
    x.gmu[:] = 0.0
    rate_values[:] = 0.0
    begin_newton(newton, newton_values)
    for e in ints(dynamics, CALLS.moving):
        _dynamic_derivatives(x, dynamics, e, w)
        scatter_dynamic_rates(rates, e, w, rate_values)
        scatter_dynamic(newton, e, w, 1.0 / c0, newton_values)
    for e in ints(constraints, CALLS.moving):
        n = _constraint_derivatives(y, constraints, e, w)
        put_acceleration_rows(y, e, n)
        scatter_constraint_rates(rates, e, w, rate_values)
        scatter_constraint(newton, e, w, 1.0 / c0, newton_values)


@compiled
def dense_constraints(constraints, w, G, W):
    """phi, phi_v and dense phi_q, (phi_q v)_q, shapes (n_phi, n_q + 7)."""
    G[:, :] = 0.0
    W[:, :] = 0.0
    x = views(constraints, w)
    for e in range(x.kernel.shape[0]):
        n = evaluate_constraint(x, constraints, e, w, 1)
        put_constraint_values(x, e, n)
        row, start = x.row[e], x.iq_ptr[e]
        for k in range(x.row[e + 1] - row):
            for i in range(n):
                G[row + k, x.iq[start + i]] += x.G[k, i]
                W[row + k, x.iq[start + i]] += x.W[k, i]


@compiled
def dense_jacobians(constraints, w, q, G):
    """phi_q at each of the positions q, shapes (k, n_q) and (k, n_phi, n_q + 7)."""
    G[:, :, :] = 0.0
    x = views(constraints, w)
    for k in range(q.shape[0]):
        for i in range(q.shape[1]):
            x.q[i] = q[k, i]
        for e in range(x.kernel.shape[0]):
            n = evaluate_constraint(x, constraints, e, w, 0)
            row, start = x.row[e], x.iq_ptr[e]
            for m in range(x.row[e + 1] - row):
                for i in range(n):
                    G[k, row + m, x.iq[start + i]] += x.G[m, i]

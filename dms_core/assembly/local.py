"""One call of a kernel: its coordinates, multipliers and inputs in, what it computed out into the system's rows.

A loop takes `views` of the arrays once and hands them on; from the tables, each call would have to look them up anew,
since for all the compiler knows a kernel may have changed them. What takes them is compiled into the loop, so that
nothing is passed.
"""

from typing import NamedTuple

import numpy as np

from dms_core.assembly.tables import CALLS, WORK
from dms_core.compiled.arena import columns_of, floats, ints, matrix, matrix_as_vector, naturals
from dms_core.compiled.calls import call_entry
from dms_core.compiled.jit import compiled


class Views(NamedTuple):
    """Views of the fields of Calls and Work with these names."""

    kernel: np.ndarray
    iq: np.ndarray
    iq_ptr: np.ndarray
    iu: np.ndarray
    iu_ptr: np.ndarray
    row: np.ndarray
    solved: np.ndarray
    solved_ptr: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    u: np.ndarray
    lam: np.ndarray
    mu: np.ndarray
    r2: np.ndarray
    gmu: np.ndarray
    phi: np.ndarray
    phi_v: np.ndarray
    phi_a: np.ndarray
    q_l: np.ndarray
    v_l: np.ndarray
    a_l: np.ndarray
    lam_l: np.ndarray
    u_l: np.ndarray
    r_l: np.ndarray
    phi_l: np.ndarray
    phi_t_l: np.ndarray
    G: np.ndarray
    W: np.ndarray


@compiled(makes_arrays=True, forceinline=True)
def views(calls, w):
    """What a loop over `calls` needs at each of them."""
    return Views(
        ints(calls, CALLS.kernel), naturals(calls, CALLS.iq), ints(calls, CALLS.iq_ptr), naturals(calls, CALLS.iu),
        ints(calls, CALLS.iu_ptr), ints(calls, CALLS.row), naturals(calls, CALLS.solved), ints(calls, CALLS.solved_ptr),
        floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.a), matrix(w, WORK.u), floats(w, WORK.lam),
        floats(w, WORK.mu), floats(w, WORK.r2), floats(w, WORK.gmu), floats(w, WORK.phi), floats(w, WORK.phi_v),
        floats(w, WORK.phi_a), floats(w, WORK.q_l), floats(w, WORK.v_l), floats(w, WORK.a_l), floats(w, WORK.lam_l),
        matrix(w, WORK.u_l), floats(w, WORK.r_l), floats(w, WORK.phi_l), matrix(w, WORK.phi_t_l), matrix(w, WORK.G),
        matrix(w, WORK.W),
    )  # fmt: skip


@compiled(forceinline=True)
def clear(block, m, n):
    """block[:m, :n] = 0."""
    for i in range(m):
        for j in range(n):
            block[i, j] = 0.0


@compiled(forceinline=True)
def clear_rows(w, k, m, n):
    """block[:m, :n] = 0 for matrix k of the work arrays, and more of these rows where that is quicker."""
    columns = columns_of(w, k)
    if columns > 2 * n:
        clear(matrix(w, k), m, n)
    else:
        # Whole rows are one stretch of memory.
        block = matrix_as_vector(w, k)
        for i in range(m * columns):
            block[i] = 0.0


@compiled(forceinline=True)
def gather(x, e, with_accelerations):
    """Copy the local q, v, inputs and, if asked for, vdot of call e; gives the number of local coordinates."""
    start = x.iq_ptr[e]
    n = x.iq_ptr[e + 1] - start
    for i in range(n):
        k = x.iq[start + i]
        x.q_l[i], x.v_l[i] = x.q[k], x.v[k]
        if with_accelerations:
            x.a_l[i] = x.a[k]
    start = x.iu_ptr[e]
    for i in range(x.iu_ptr[e + 1] - start):
        for j in range(3):
            x.u_l[i, j] = x.u[x.iu[start + i], j]
    return n


@compiled(forceinline=True)
def evaluate_dynamic(x, calls, e, w, level):
    """Run the dynamic kernel of call e into r_l and, for level 1, Jq, Jv, Ja; gives n."""
    n = gather(x, e, True)
    for i in range(n):
        x.r_l[i] = 0.0
    if level > 0:
        clear_rows(w, WORK.Jq, n, n)
        clear_rows(w, WORK.Jv, n, n)
        clear_rows(w, WORK.Ja, n, n)
    call_entry(x.kernel[e], calls, e, w, level)
    return n


@compiled(forceinline=True)
def add_dynamic_rows(x, e, n):
    """r2 += r_l of call e."""
    start = x.iq_ptr[e]
    for i in range(n):
        x.r2[x.iq[start + i]] += x.r_l[i]


@compiled(forceinline=True)
def add_solved_rows(x, e, n):
    """As add_dynamic_rows, of the coordinates that are solved for alone."""
    start, first, end = x.iq_ptr[e], x.solved_ptr[e], x.solved_ptr[e + 1]
    if end - first == n:
        add_dynamic_rows(x, e, n)
        return
    for p in range(first, end):
        i = x.solved[p]
        x.r2[x.iq[start + i]] += x.r_l[i]


@compiled(forceinline=True)
def evaluate_constraint(x, calls, e, w, level):
    """Run the constraint kernel of call e into phi_l, phi_t_l, G and, for level 1, W, H, with its vdot; gives n."""
    n = gather(x, e, level > 0)
    row = x.row[e]
    m = x.row[e + 1] - row
    clear_rows(w, WORK.G, m, n)
    for k in range(m):
        x.lam_l[k] = x.lam[row + k]
        x.phi_l[k] = x.phi_t_l[k, 0] = x.phi_t_l[k, 1] = 0.0
    if level > 0:
        clear_rows(w, WORK.W, m, n)
        clear_rows(w, WORK.H, n, n)
    call_entry(x.kernel[e], calls, e, w, level)
    return n


@compiled(forceinline=True)
def put_constraint_values(x, e, n):
    """Rows of phi and phi_q v + phi_t of call e."""
    row = x.row[e]
    for k in range(x.row[e + 1] - row):
        rate = x.phi_t_l[k, 0]
        for i in range(n):
            rate += x.G[k, i] * x.v_l[i]
        x.phi[row + k], x.phi_v[row + k] = x.phi_l[k], rate


@compiled(forceinline=True)
def add_constraint_forces(x, e, n):
    """phi_q^T lam into r2 and phi_q^T mu into gmu, of call e."""
    start, row = x.iq_ptr[e], x.row[e]
    for k in range(x.row[e + 1] - row):
        lam, mu = x.lam[row + k], x.mu[row + k]
        for i in range(n):
            x.r2[x.iq[start + i]] += x.G[k, i] * lam
            x.gmu[x.iq[start + i]] += x.G[k, i] * mu


@compiled(forceinline=True)
def put_solved_values(x, e, n):
    """As put_constraint_values; coordinates that are not solved for rest."""
    row, first, end = x.row[e], x.solved_ptr[e], x.solved_ptr[e + 1]
    if end - first == n:
        put_constraint_values(x, e, n)
        return
    for k in range(x.row[e + 1] - row):
        rate = x.phi_t_l[k, 0]
        for p in range(first, end):
            i = x.solved[p]
            rate += x.G[k, i] * x.v_l[i]
        x.phi[row + k], x.phi_v[row + k] = x.phi_l[k], rate


@compiled(forceinline=True)
def add_solved_forces(x, e, n):
    """As add_constraint_forces, of the coordinates that are solved for alone."""
    start, row, first, end = x.iq_ptr[e], x.row[e], x.solved_ptr[e], x.solved_ptr[e + 1]
    if end - first == n:
        add_constraint_forces(x, e, n)
        return
    m = x.row[e + 1] - row
    for p in range(first, end):
        i = x.solved[p]
        at = x.iq[start + i]
        force, drift = x.r2[at], x.gmu[at]
        for k in range(m):
            force += x.G[k, i] * x.lam[row + k]
            drift += x.G[k, i] * x.mu[row + k]
        x.r2[at], x.gmu[at] = force, drift


@compiled(forceinline=True)
def put_acceleration_rows(x, e, n):
    """phi_a = phi_q vdot + (phi_q v)_q v + phi_tt of call e, evaluated at level 1."""
    row = x.row[e]
    for k in range(x.row[e + 1] - row):
        rate = x.phi_t_l[k, 1]
        for i in range(n):
            rate += x.G[k, i] * x.a_l[i] + x.W[k, i] * x.v_l[i]
        x.phi_a[row + k] = rate


@compiled(forceinline=True)
def evaluate_sensor(x, sensors, e, first, end, w, level):
    """Run the sensor kernel of call e into y_l and, for level 1, its derivatives; lam[first:end] is handed in."""
    n = gather(x, e, True)
    m = x.row[e + 1] - x.row[e]
    y_l, Yl, Yu = floats(w, WORK.y_l), matrix(w, WORK.Yl), matrix(w, WORK.Yu)
    for k in range(end - first):
        x.lam_l[k] = x.lam[first + k]
    y_l[:m] = 0.0
    if level > 0:
        clear(matrix(w, WORK.Yq), m, n)
        clear(matrix(w, WORK.Yv), m, n)
        clear(matrix(w, WORK.Ya), m, n)
        clear(Yl, m, Yl.shape[1])
        clear(Yu, m, Yu.shape[1])
    call_entry(x.kernel[e], sensors, e, w, level)
    return n

"""Solves with the factorised matrix of a stage: tangents forward, adjoints back; see stage.py for the equations."""

from dms_core.assembly.tables import MODEL
from dms_core.compiled.arena import floats, indices, ints, matrix, naturals
from dms_core.compiled.jit import compiled
from dms_core.sensitivity.tangents.tables import ADJOINTS, COLUMNS, DIFFERENTIALS
from dms_core.sensitivity.tangents.tables import STAGE as AT
from dms_core.simulation.iteration.linear_solve import back_substitute, back_substitute_transposed


@compiled
def _add_left_out(d, g, x, free, b, transposed):
    """b[:n] += (phi_q^T mu)_q x[:n], or its transpose, in what is solved for."""
    by_mu, rows, columns = (
        floats(g, AT.by_mu), indices(d, DIFFERENTIALS.mu_rows), indices(d, DIFFERENTIALS.mu_columns),
    )  # fmt: skip
    full, out, n = floats(d, DIFFERENTIALS.full), floats(d, DIFFERENTIALS.more), free.shape[0]
    full[:] = 0.0
    out[:] = 0.0
    for j in range(n):
        full[free[j]] = x[j]
    for e in range(rows.shape[0]):
        if transposed:
            out[columns[e]] += by_mu[e] * full[rows[e]]
        else:
            out[rows[e]] += by_mu[e] * full[columns[e]]
    for j in range(n):
        b[j] += out[free[j]]


@compiled
def _scale(x, n, k, c0, rows):
    """x times the scales of the equations (rows) or of the unknowns, see sparsity.py."""
    h = 1.0 / c0
    for j in range(n):
        if rows:
            x[j] *= h
            x[n + j] *= h * h
        else:
            x[n + j] *= c0
    for j in range(k):
        if rows:
            x[2 * n + k + j] *= h
        else:
            x[2 * n + j] *= c0 * c0
            x[2 * n + k + j] *= c0


@compiled
def solve_stage_matrix(m, d, g, c0, transposed):
    """x of A x = r, or of A^T x = r, in what is solved for; r and x are those of d."""
    free, active = naturals(m, MODEL.free), naturals(m, MODEL.active)
    r, x, b = floats(d, DIFFERENTIALS.r), floats(d, DIFFERENTIALS.x), floats(d, DIFFERENTIALS.b)
    values, work = floats(g, AT.factors), floats(d, DIFFERENTIALS.work)
    n, k = free.shape[0], active.shape[0]
    for sweep in range(1 + ints(g, AT.sweeps)[0]):
        for j in range(r.shape[0]):
            b[j] = r[j]
        if sweep > 0:
            _add_left_out(d, g, x, free, b, transposed)
        _scale(b, n, k, c0, not transposed)
        if transposed:
            back_substitute_transposed(m, MODEL.newton_lu, values, b, x, work)
        else:
            back_substitute(m, MODEL.newton_lu, values, b, x, work)
        _scale(x, n, k, c0, transposed)


@compiled
def _put_right_side(m, d, g, c, k, stage, dcq, dcv):
    """r of column k at a stage: (dcq, -r2_a dcv, 0, 0) less what its inputs and its declared number move."""
    free, active, r = naturals(m, MODEL.free), naturals(m, MODEL.active), floats(d, DIFFERENTIALS.r)
    by_a, rows, columns = (
        floats(g, AT.by_a), indices(d, DIFFERENTIALS.a_rows), indices(d, DIFFERENTIALS.a_columns),
    )  # fmt: skip
    r2_u, r3_u, r4_u = matrix(g, AT.r2_u), matrix(g, AT.r3_u), matrix(g, AT.r4_u)
    full, n, a = floats(d, DIFFERENTIALS.full), free.shape[0], active.shape[0]
    full[:] = 0.0
    for e in range(rows.shape[0]):
        full[rows[e]] += by_a[e] * dcv[columns[e]]
    for j in range(n):
        r[j], r[n + j] = dcq[free[j]], -full[free[j]]
    r[2 * n :] = 0.0
    du = matrix(c, COLUMNS.du)[stage * matrix(c, COLUMNS.dq).shape[0] + k]
    for i in range(du.shape[0]):
        if du[i] != 0.0:
            for j in range(n):
                r[n + j] -= r2_u[i, free[j]] * du[i]
            for j in range(a):
                r[2 * n + j] -= r3_u[i, active[j]] * du[i]
                r[2 * n + a + j] -= r4_u[i, active[j]] * du[i]
    p = ints(c, COLUMNS.parameter)[k]
    if p >= 0:
        all_q = dcq.shape[0]
        r_p = matrix(g, AT.r_p)[p]
        all_rows = (r_p.shape[0] - 2 * all_q) // 2
        for j in range(n):
            r[j] -= r_p[free[j]]
            r[n + j] -= r_p[all_q + free[j]]
        for j in range(a):
            r[2 * n + j] -= r_p[2 * all_q + active[j]]
            r[2 * n + a + j] -= r_p[2 * all_q + all_rows + active[j]]


@compiled
def column_forward(m, d, g, c, k, stage, c0):
    """Column k of a stage: from cq, cv of the column to stage_q, stage_v and dlam.

    Coordinates that are not solved for are left as they are.
    """
    free, active, x = naturals(m, MODEL.free), naturals(m, MODEL.active), floats(d, DIFFERENTIALS.x)
    _put_right_side(m, d, g, c, k, stage, matrix(c, COLUMNS.cq)[k], matrix(c, COLUMNS.cv)[k])
    solve_stage_matrix(m, d, g, c0, False)
    stage_q, stage_v, dlam = matrix(c, COLUMNS.stage_q), matrix(c, COLUMNS.stage_v), matrix(c, COLUMNS.dlam)
    n = free.shape[0]
    for j in range(n):
        stage_q[k, free[j]], stage_v[k, free[j]] = x[j], x[n + j]
    for j in range(active.shape[0]):
        dlam[k, active[j]] = x[2 * n + j]


@compiled
def output_back(m, d, g, b, k, aq, av, c0):
    """Output k through a stage: from its derivatives aq, av by the stage's q, v to those by cq, cv, inputs, numbers.

    Those by cq and cv are written into the rows k of the Adjoints `b`, the others are added there.
    """
    free, active = naturals(m, MODEL.free), naturals(m, MODEL.active)
    r, x, full = floats(d, DIFFERENTIALS.r), floats(d, DIFFERENTIALS.x), floats(d, DIFFERENTIALS.full)
    by_a, rows, columns = (
        floats(g, AT.by_a), indices(d, DIFFERENTIALS.a_rows), indices(d, DIFFERENTIALS.a_columns),
    )  # fmt: skip
    n = free.shape[0]
    r[:] = 0.0
    for j in range(n):
        r[j], r[n + j] = aq[free[j]], av[free[j]]
    solve_stage_matrix(m, d, g, c0, True)
    cq, cv = matrix(b, ADJOINTS.cq)[k], matrix(b, ADJOINTS.cv)[k]
    cq[:] = 0.0
    cv[:] = 0.0
    full[:] = 0.0
    for j in range(n):
        cq[free[j]] = x[j]
        full[free[j]] = x[n + j]
    for e in range(rows.shape[0]):
        cv[columns[e]] -= by_a[e] * full[rows[e]]
    _inputs_back(g, x, free, active, matrix(b, ADJOINTS.au)[k])
    _numbers_back(g, x, free, active, matrix(b, ADJOINTS.ap)[k], cq.shape[0])


@compiled
def _inputs_back(g, x, free, active, au):
    """Add what an output owes to the inputs of a stage, from the solution x of its transposed system."""
    r2_u, r3_u, r4_u = matrix(g, AT.r2_u), matrix(g, AT.r3_u), matrix(g, AT.r4_u)
    n, a = free.shape[0], active.shape[0]
    for i in range(au.shape[0]):
        total = 0.0
        for j in range(n):
            total += r2_u[i, free[j]] * x[n + j]
        for j in range(a):
            total += r3_u[i, active[j]] * x[2 * n + j] + r4_u[i, active[j]] * x[2 * n + a + j]
        au[i] -= total


@compiled
def _numbers_back(g, x, free, active, ap, all_q):
    """Add what an output owes to the declared numbers of a stage."""
    r_p, n, a = matrix(g, AT.r_p), free.shape[0], active.shape[0]
    all_rows = (r_p.shape[1] - 2 * all_q) // 2
    for i in range(ap.shape[0]):
        total = 0.0
        for j in range(n):
            total += r_p[i, free[j]] * x[j] + r_p[i, all_q + free[j]] * x[n + j]
        for j in range(a):
            row = 2 * all_q + active[j]
            total += r_p[i, row] * x[2 * n + j] + r_p[i, row + all_rows] * x[2 * n + a + j]
        ap[i] -= total

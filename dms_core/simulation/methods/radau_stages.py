"""The stages of a Radau step: values in and out of the iterate, their guess, their residual.

Stage i is q_i, v_i, lam_i, mu_i at t + c_i h, with the rates of the collocation polynomial,

    qdot_i = sum_j (A^-1)_ij (q_j - q_n) / h,      vdot_i likewise,

put into the residual of eq. 2.
"""

from dms_core.assembly.tables import MODEL, WORK
from dms_core.compiled.arena import flags, floats, inner, matrix, naturals
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.parts import PARTS, run_part, set_inputs
from dms_core.simulation.methods.radau_constants import A_INVERSE, STAGES, C
from dms_core.simulation.methods.radau_state import CONTROL, RADAU
from dms_core.simulation.state import STATE


@compiled
def put_stage(m, s, i, t, h):
    """Stage i with its rates and inputs into the iterate."""
    w, radau = inner(s, STATE.w), inner(s, STATE.radau)
    q, v, a, lam, mu = (
        floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.a), floats(w, WORK.lam), floats(w, WORK.mu),
    )  # fmt: skip
    q_n, v_n = floats(s, STATE.q), floats(s, STATE.v)
    stage_q, stage_v = matrix(radau, RADAU.q), matrix(radau, RADAU.v)
    stage_lam, stage_mu = matrix(radau, RADAU.lam), matrix(radau, RADAU.mu)
    for k in range(q_n.shape[0]):
        q[k], v[k] = stage_q[i, k], stage_v[i, k]
        a[k] = rate(i, stage_v, v_n, k, h)
    for k in range(lam.shape[0]):
        lam[k], mu[k] = stage_lam[i, k], stage_mu[i, k]
    set_inputs(m, s, t + C[i] * h, True)


@compiled
def rate(i, stage, start, k, h):
    """Rate of coordinate k at stage i."""
    w = A_INVERSE[i]
    y = start[k]
    return (w[0] * (stage[0, k] - y) + w[1] * (stage[1, k] - y) + w[2] * (stage[2, k] - y)) / h


@compiled
def take_residual(m, s, i, h):
    """-(r1, r2, r3, r4) of stage i, which is the evaluated iterate."""
    w, radau = inner(s, STATE.w), inner(s, STATE.radau)
    free, active = naturals(m, MODEL.free), naturals(m, MODEL.active)
    v, gmu, r2 = floats(w, WORK.v), floats(w, WORK.gmu), floats(w, WORK.r2)
    phi, phi_v = floats(w, WORK.phi), floats(w, WORK.phi_v)
    stage_q, q_n, out = matrix(radau, RADAU.q), floats(s, STATE.q), matrix(radau, RADAU.residual)
    n, k = free.shape[0], active.shape[0]
    for j in range(n):
        c = free[j]
        out[i, j] = rate(i, stage_q, q_n, c, h) + gmu[c] - v[c]
        out[i, n + j] = -r2[c]
    for j in range(k):
        out[i, 2 * n + j] = -phi[active[j]]
        out[i, 2 * n + k + j] = -phi_v[active[j]]


@compiled
def evaluate_stages(m, s, t, h):
    """The residuals of all stages."""
    for i in range(STAGES):
        put_stage(m, s, i, t, h)
        run_part(m, s, PARTS.residual)
        take_residual(m, s, i, h)


@compiled
def lagrange(nodes, first, j, x):
    """Polynomial that is 1 at node j and 0 at the others, from node `first` on."""
    value = 1.0
    for k in range(first, STAGES + 1):
        if k != j:
            value *= (x - nodes[k]) / (nodes[j] - nodes[k])
    return value


NODES = (0.0, *C)


@compiled
def guess_stages(m, s, h, started):
    """The collocation polynomial of the step before, carried on; behind a start a parabola.

    Rates of first-order coordinates are those of their guess.
    """
    radau, second = inner(s, STATE.radau), flags(m, MODEL.second)
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    lam_n = floats(s, STATE.lam)
    stage_q, stage_v = matrix(radau, RADAU.q), matrix(radau, RADAU.v)
    stage_lam, stage_mu = matrix(radau, RADAU.lam), matrix(radau, RADAU.mu)
    past_q, past_v = matrix(radau, RADAU.past_q), matrix(radau, RADAU.past_v)
    past_lam, past_mu = matrix(radau, RADAU.past_lam), matrix(radau, RADAU.past_mu)
    n, k = q.shape[0], lam_n.shape[0]
    for i in range(STAGES):
        if started:
            x = C[i] * h
            for c in range(n):
                stage_q[i, c] = q[c] + x * (qd[c] + 0.5 * x * vd[c])
                stage_v[i, c] = v[c] + x * vd[c]
            for c in range(k):
                stage_lam[i, c], stage_mu[i, c] = lam_n[c], 0.0
            continue
        x = 1.0 + C[i] * h / floats(radau, RADAU.control)[CONTROL.h_before]
        for c in range(n):
            stage_q[i, c], stage_v[i, c] = q[c], v[c]
        for c in range(k):
            stage_lam[i, c], stage_mu[i, c] = 0.0, 0.0
        for j in range(STAGES + 1):
            weight = lagrange(NODES, 0, j, x)
            for c in range(n):
                stage_q[i, c] += weight * (past_q[j, c] - q[c])
                stage_v[i, c] += weight * (past_v[j, c] - v[c])
        for j in range(STAGES):
            weight = lagrange(NODES, 1, j + 1, x)
            for c in range(k):
                stage_lam[i, c] += weight * past_lam[j, c]
                stage_mu[i, c] += weight * past_mu[j, c]
    for i in range(STAGES):
        for c in range(n):
            if not second[c]:
                stage_v[i, c] = rate(i, stage_q, q, c, h)
    # Where a run fails, the coordinate that has moved farthest from here is named.
    q_guess = floats(s, STATE.q_guess)
    for c in range(n):
        q_guess[c] = stage_q[STAGES - 1, c]


@compiled
def remember_stages(s, h):
    """Keep begin and stages of the step that is about to be accepted."""
    radau = inner(s, STATE.radau)
    q, v = floats(s, STATE.q), floats(s, STATE.v)
    stage_q, stage_v = matrix(radau, RADAU.q), matrix(radau, RADAU.v)
    stage_lam, stage_mu = matrix(radau, RADAU.lam), matrix(radau, RADAU.mu)
    past_q, past_v = matrix(radau, RADAU.past_q), matrix(radau, RADAU.past_v)
    past_lam, past_mu = matrix(radau, RADAU.past_lam), matrix(radau, RADAU.past_mu)
    for c in range(q.shape[0]):
        past_q[0, c], past_v[0, c] = q[c], v[c]
    for i in range(STAGES):
        for c in range(q.shape[0]):
            past_q[1 + i, c], past_v[1 + i, c] = stage_q[i, c], stage_v[i, c]
        for c in range(past_lam.shape[1]):
            past_lam[i, c], past_mu[i, c] = stage_lam[i, c], stage_mu[i, c]
    floats(radau, RADAU.control)[CONTROL.h_before] = h


@compiled
def take_last_stage(s, h, c0):
    """The last stage into the iterate, and cq, cv so that its rates are c0 q + cq and c0 v + cv."""
    w, radau = inner(s, STATE.w), inner(s, STATE.radau)
    q, v, cq, cv = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.cq), floats(s, STATE.cv)
    stage_q, stage_v = matrix(radau, RADAU.q), matrix(radau, RADAU.v)
    q_w, v_w = floats(w, WORK.q), floats(w, WORK.v)
    last = STAGES - 1
    for c in range(q.shape[0]):
        q_w[c], v_w[c] = stage_q[last, c], stage_v[last, c]
        cq[c] = rate(last, stage_q, q, c, h) - c0 * q_w[c]
        cv[c] = rate(last, stage_v, v, c, h) - c0 * v_w[c]
    lam, mu = floats(w, WORK.lam), floats(w, WORK.mu)
    stage_lam, stage_mu = matrix(radau, RADAU.lam), matrix(radau, RADAU.mu)
    for c in range(lam.shape[0]):
        lam[c], mu[c] = stage_lam[last, c], stage_mu[last, c]

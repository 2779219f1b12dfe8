"""Variable-step BDF2 with a two-stage start, and the local error of both (paper sect. 2.3).

With w = h / h_before:

    ydot ~ [ (1 + 2w)/(1 + w) y - (1 + w) y_n + w^2/(1 + w) y_(n-1) ] / h
    local error  C y''' ,  C = h^3 (1 + w)^2 / (6 w (1 + 2w))

zero-stable for w < 1 + sqrt 2 (Hairer, Norsett, Wanner 1993, III.5). A run, and every jump of an input, starts with
the L-stable SDIRK method of order 2 with gamma = 1 - 1/sqrt 2 (Alexander 1977): it needs no past, and its two stages
have the same form qdot = c0 q + cq. Its error constant is |1/6 - 3 gamma^2 + 2 gamma^3| = 0.0404 h^3 y'''.
"""

import math

from dms_core.assembly.tables import WORK
from dms_core.compiled.arena import flags, floats, inner, ints, naturals
from dms_core.compiled.jit import compiled
from dms_core.simulation.newton import CONVERGED, DIVERGED, STALE_MATRIX, newton
from dms_core.simulation.parts import set_inputs
from dms_core.simulation.state import AGE, H_BEFORE, H_BEFORE2, MODEL, STALE, STATE, T

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)
SDIRK_ERROR = 0.0404
LOCAL_SHARE = 0.1
"""Share of the tolerance that one step may use up: the errors of hundreds of steps add up."""
COARSEST_RATE = 0.01
"""Largest weight of a first-order rate, relative to its size."""
MAX_AGE = 30
"""Stages after which a factorised matrix is renewed, however well it still contracts."""


@compiled
def set_weights(m, s, o):
    """Error weights, a share of atol + rtol |y|, from the last accepted values.

    Rates of first-order coordinates add nothing to the error of a step: Newton's method alone looks at them. Their
    weight is the whole of that sum, but fine enough for what they enter, such as the curve of force and velocity.
    """
    q, v, wq, wv = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.wq), floats(s, STATE.wv)
    scale_q, scale_v, second = floats(m, MODEL.scale_q), floats(m, MODEL.scale_v), flags(m, MODEL.second)
    for i in range(q.shape[0]):
        wq[i] = LOCAL_SHARE * ((o.atol if o.atol > 0.0 else o.rtol * scale_q[i]) + o.rtol * abs(q[i]))
        wv[i] = (o.atol if o.atol > 0.0 else o.rtol * scale_v[i]) + o.rtol * abs(v[i])
        wv[i] = LOCAL_SHARE * wv[i] if second[i] else min(wv[i], COARSEST_RATE * (scale_v[i] + abs(v[i])))


@compiled
def put_guess(m, s, c0, lam_slope):
    """The guess into the iterate; first-order coordinates get the v that belongs to their q.

    Coordinates that are not solved for stay: a guess that nothing corrects would run away from rounding errors.
    """
    w, second, cq, free = inner(s, STATE.w), flags(m, MODEL.second), floats(s, STATE.cq), naturals(m, MODEL.free)
    q, v, lam, mu = floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.lam), floats(w, WORK.mu)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    lam_n, lam_before, mu_n = floats(s, STATE.lam), floats(s, STATE.lam_before), floats(s, STATE.mu)
    for i in free:
        q[i] = q_guess[i]
        v[i] = v_guess[i] if second[i] else c0 * q_guess[i] + cq[i]
    for k in range(lam_n.shape[0]):
        lam[k] = lam_n[k] + lam_slope * (lam_n[k] - lam_before[k])
        mu[k] = mu_n[k]


@compiled
def solve_stage(m, s, o, t, c0, lam_slope, last):
    """One implicit stage at time t from the guess; gives (code, iterations). An old matrix is renewed once.

    Only the last stage of a step has to close the constraints.
    """
    count = ints(s, STATE.counts)
    set_inputs(m, s, t, True)
    count[AGE] += 1
    if count[AGE] > MAX_AGE:
        count[STALE] = 1
    put_guess(m, s, c0, lam_slope)
    code, iterations = newton(m, s, o, c0, last)
    if code == STALE_MATRIX:
        count[STALE] = 1
        put_guess(m, s, c0, lam_slope)
        code, more = newton(m, s, o, c0, last)
        iterations += more
        if code == STALE_MATRIX:
            code = DIVERGED
    return code, iterations


@compiled
def _prepare_bdf2(s, h, h1):
    """Constants cq, cv of the step; its guess, the quadratic through y_n, y_(n-1) and ydot_n, which carries y_(n-2)."""
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    q_before, v_before = floats(s, STATE.q_before), floats(s, STATE.v_before)
    cq, cv = floats(s, STATE.cq), floats(s, STATE.cv)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    ratio = h / h1
    b1, b2 = -(1.0 + ratio) / h, ratio * ratio / (1.0 + ratio) / h
    for i in range(q.shape[0]):
        cq[i] = b1 * q[i] + b2 * q_before[i]
        cv[i] = b1 * v[i] + b2 * v_before[i]
        q_guess[i] = q[i] + h * (qd[i] + ratio * (qd[i] - (q[i] - q_before[i]) / h1))
        v_guess[i] = v[i] + h * (vd[i] + ratio * (vd[i] - (v[i] - v_before[i]) / h1))


@compiled
def bdf2_step(m, s, o, h):
    """One BDF2 step of size h into w. Gives (code, iterations, weighted local error)."""
    clock = floats(s, STATE.clock)
    h1, h2 = clock[H_BEFORE], clock[H_BEFORE2]
    ratio = h / h1
    _prepare_bdf2(s, h, h1)
    code, iterations = solve_stage(m, s, o, clock[T] + h, (1.0 + 2.0 * ratio) / (1.0 + ratio) / h, ratio, True)
    if code != CONVERGED:
        return code, iterations, 0.0
    C = h**3 * (1.0 + ratio) ** 2 / (6.0 * ratio * (1.0 + 2.0 * ratio))
    # The guess interpolates three past points or, behind a start, two and a slope: its error is P y'''.
    P = h * (h + h1) * (h + h1 + h2) / 6.0 if h2 > 0.0 else h * h * (h + h1) / 6.0
    w, second, error = inner(s, STATE.w), flags(m, MODEL.second), 0.0
    q, v, wq, wv = floats(w, WORK.q), floats(w, WORK.v), floats(s, STATE.wq), floats(s, STATE.wv)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    for i in range(wq.shape[0]):
        error = max(error, abs(q[i] - q_guess[i]) / wq[i])
        if second[i]:
            error = max(error, abs(v[i] - v_guess[i]) / wv[i])
    return code, iterations, error * C / (C + P)


@compiled
def _prepare_first_stage(s, h, c0):
    """Constants and guess of the stage at GAMMA h."""
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    cq, cv = floats(s, STATE.cq), floats(s, STATE.cv)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    for i in range(q.shape[0]):
        cq[i], cv[i] = -c0 * q[i], -c0 * v[i]
        q_guess[i], v_guess[i] = q[i] + GAMMA * h * qd[i], v[i] + GAMMA * h * vd[i]


@compiled
def _prepare_second_stage(s, h, c0):
    """Rates of the first stage; constants and guess of the one at h."""
    w = inner(s, STATE.w)
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    q1, v1, cq, cv = floats(w, WORK.q), floats(w, WORK.v), floats(s, STATE.cq), floats(s, STATE.cv)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    for i in range(q.shape[0]):
        kq, kv = c0 * q1[i] + cq[i], c0 * v1[i] + cv[i]
        cq[i] = -c0 * (q[i] + h * (1.0 - GAMMA) * kq)
        cv[i] = -c0 * (v[i] + h * (1.0 - GAMMA) * kv)
        q_guess[i] = q[i] + h * qd[i] + 0.5 * h / GAMMA * (kq - qd[i])
        v_guess[i] = v[i] + h * vd[i] + 0.5 * h / GAMMA * (kv - vd[i])


@compiled
def start_step(m, s, o, h):
    """One SDIRK2 step of size h into w. Gives (code, iterations, weighted local error)."""
    t, c0 = floats(s, STATE.clock)[T], 1.0 / (GAMMA * h)
    _prepare_first_stage(s, h, c0)
    code, first = solve_stage(m, s, o, t + GAMMA * h, c0, 0.0, False)
    if code != CONVERGED:
        return code, first, 0.0
    _prepare_second_stage(s, h, c0)
    code, second = solve_stage(m, s, o, t + h, c0, 0.0, True)
    if code != CONVERGED:
        return code, first + second, 0.0
    w, is_second, error = inner(s, STATE.w), flags(m, MODEL.second), 0.0
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    q1, v1, cq, cv = floats(w, WORK.q), floats(w, WORK.v), floats(s, STATE.cq), floats(s, STATE.cv)
    wq, wv = floats(s, STATE.wq), floats(s, STATE.wv)
    for i in range(q.shape[0]):
        # h^3 y''' of the cubic through both ends and their slopes.
        third = 6.0 * h * (qd[i] + c0 * q1[i] + cq[i]) - 12.0 * (q1[i] - q[i])
        error = max(error, SDIRK_ERROR * abs(third) / wq[i])
        if is_second[i]:
            third = 6.0 * h * (vd[i] + c0 * v1[i] + cv[i]) - 12.0 * (v1[i] - v[i])
            error = max(error, SDIRK_ERROR * abs(third) / wv[i])
    return code, first + second, error
